#include "processing/pipeline/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "acquisition/frame/error.h"
#include "acquisition/session/natural_order.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/picture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

std::vector<fs::path> files_in(const fs::path& folder) {
    if (!fs::is_directory(folder))
        throw InputError(fmt::format("{} is not a folder", folder.string()), "give a folder of photographs");
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file() && !entry.path().filename().string().starts_with('.'))
            files.push_back(entry.path());
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return natural_less(a.filename().string(), b.filename().string());
    });
    return files;
}

bool is_diligent(const fs::path& folder) {
    return fs::exists(folder / "filenames.txt") && fs::exists(folder / "light_directions.txt");
}

std::optional<fs::path> if_there(const fs::path& path) { return fs::exists(path) ? std::optional(path) : std::nullopt; }

fs::path require_listed(const fs::path& folder, const std::string& name, const fs::path& list) {
    const fs::path path = folder / name;
    if (!fs::is_regular_file(path))
        throw InputError(fmt::format("{} is named in {} but is not there", path.string(), list.string()),
                         "add the photograph, or take its line out");
    return path;
}

std::vector<std::string> names_in(const fs::path& list) {
    std::vector<std::string> names;
    const std::string text = read_text(list);
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find_first_of("\r\n", start), text.size());
        if (end > start) names.push_back(text.substr(start, end - start));
        start = end + 1;
    }
    return names;
}

Survey survey_diligent(const fs::path& folder) {
    const fs::path list = folder / "filenames.txt", directions = folder / "light_directions.txt";
    for (const fs::path& needed : {list, directions})
        if (!fs::exists(needed))
            throw InputError(fmt::format("{} is missing from the DiLiGenT folder", needed.string()),
                             "a DiLiGenT folder holds filenames.txt, light_directions.txt, light_intensities.txt");
    Survey survey;
    survey.layout = "DiLiGenT folder";
    for (const std::string& name : names_in(list)) survey.frames.push_back(require_listed(folder, name, list));
    if (const auto mask = if_there(folder / "mask.png")) survey.masks.push_back(*mask);
    survey.lights = directions;
    survey.intensities = if_there(folder / "light_intensities.txt");
    survey.truth = if_there(folder / "Normal_gt.mat");
    return survey;
}

std::optional<fs::path> the_lp_file(const std::vector<fs::path>& files) {
    std::optional<fs::path> lp;
    for (const fs::path& file : files) {
        if (lower(file.extension().string()) != ".lp") continue;
        if (lp)
            throw InputError(fmt::format("there are two .lp files: {} and {}", lp->string(), file.string()),
                             "say which one with --lights, or move the other away");
        lp = file;
    }
    return lp;
}

Survey survey_rti(const fs::path& folder, const fs::path& lp, const std::vector<fs::path>& files) {
    Survey survey;
    survey.layout = "RTI folder with " + lp.filename().string();
    survey.lights = lp;
    for (const Light& light : read_lights(lp).lights) survey.frames.push_back(require_listed(folder, light.file, lp));
    std::copy_if(files.begin(), files.end(), std::back_inserter(survey.masks),
                 [](const fs::path& file) { return picture_format_of(file) && is_mask_name(file); });
    return survey;
}

Survey survey_plain(const fs::path& folder, const std::vector<fs::path>& files) {
    Survey survey;
    survey.layout = "plain folder";
    for (const fs::path& file : files)
        if (picture_format_of(file)) (is_mask_name(file) ? survey.masks : survey.frames).push_back(file);
    if (survey.frames.empty())
        throw InputError(fmt::format("{} holds no photographs", folder.string()),
                         "give a folder of PNG, TIFF, JPEG or EXR pictures");
    return survey;
}

Survey survey_one(const fs::path& folder, ImportLayout layout) {
    const std::vector<fs::path> files = files_in(folder);
    const bool automatic = layout == ImportLayout::automatic;
    if (layout == ImportLayout::diligent || (automatic && is_diligent(folder))) return survey_diligent(folder);
    const auto lp = automatic ? the_lp_file(files) : std::nullopt;
    if (lp && read_lights(*lp).form == LightFileForm::lp) return survey_rti(folder, *lp, files);
    return survey_plain(folder, files);
}

}  // namespace

bool is_mask_name(const fs::path& path) {
    const std::string stem = lower(path.stem().string());
    constexpr std::string_view separators = "._- ";
    const std::string first = stem.substr(0, stem.find_first_of(separators));
    const auto last = stem.find_last_of(separators);
    return first == "mask" || (last != std::string::npos && stem.substr(last + 1) == "mask");
}

Survey survey_folders(const std::vector<fs::path>& folders, ImportLayout layout) {
    if (folders.size() == 1) return survey_one(folders.front(), layout);
    Survey all;
    all.layout = fmt::format("{} folders", folders.size());
    for (const fs::path& folder : folders) {
        const Survey one = survey_one(folder, layout);
        if (one.lights || layout == ImportLayout::diligent || is_diligent(folder))
            throw InputError(fmt::format("{} comes with its own lights ({})", folder.string(), one.layout),
                             "import such a folder by itself");
        all.frames.insert(all.frames.end(), one.frames.begin(), one.frames.end());
        all.masks.insert(all.masks.end(), one.masks.begin(), one.masks.end());
    }
    return all;
}

}  // namespace darkbox
