#include "processing/pipeline/given_lights.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/formats/light_files.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

const Light* named(const Lights& lights, const std::string& file) {
    const auto same = std::find_if(lights.begin(), lights.end(), [&](const Light& l) { return l.file == file; });
    if (same != lights.end()) return &*same;
    const auto stem = fs::path(file).stem();  // an .lp written for JPEGs of the same photographs
    const auto alike =
        std::find_if(lights.begin(), lights.end(), [&](const Light& l) { return fs::path(l.file).stem() == stem; });
    return alike == lights.end() ? nullptr : &*alike;
}

Lights by_name(const Lights& lights, const std::vector<std::string>& files, const fs::path& path) {
    Lights ordered;
    for (const std::string& file : files) {
        const Light* light = named(lights, file);
        if (!light)
            throw InputError(fmt::format("{} has no light for the photograph {}", path.string(), file),
                             "add its line, or move the photograph away");
        ordered.push_back(*light);
    }
    return ordered;
}

void apply_intensities(Lights& lights, const fs::path& path) {
    const auto intensities = read_light_intensities(path);
    if (intensities.size() != lights.size())
        throw InputError(
            fmt::format("{} has {} intensities for {} lights", path.string(), intensities.size(), lights.size()),
            "give one line for each photograph");
    for (std::size_t i = 0; i < lights.size(); ++i) lights[i].intensity = intensities[i];
}

}  // namespace

GivenLights lights_for(const std::vector<std::string>& files, const fs::path& path,
                       const std::optional<fs::path>& intensities) {
    const LightFile file = read_lights(path);
    GivenLights given{file.lights, file.warnings, intensities.has_value()};
    if (intensities) apply_intensities(given.lights, *intensities);
    if (file.form == LightFileForm::lp) given.lights = by_name(given.lights, files, path);
    if (given.lights.size() != files.size())
        throw InputError(
            fmt::format("{} has {} lights for {} photographs", path.string(), given.lights.size(), files.size()),
            "give one line for each photograph, in their natural order");
    for (std::size_t i = 0; i < files.size(); ++i) given.lights[i].file = files[i];
    return given;
}

std::optional<GivenLights> given_lights(const Session& session) {
    auto path = extra_of(session, given_lp);
    if (!path) path = extra_of(session, given_plain_lights);
    if (!path) return std::nullopt;
    std::vector<std::string> own_names, files;
    for (const FrameRecord& frame : photographs_of(session, FrameKind::lit)) {
        own_names.push_back(frame.lamp_name);
        files.push_back(basename_of(frame));
    }
    GivenLights given = lights_for(own_names, *path, extra_of(session, given_intensities));
    for (std::size_t i = 0; i < files.size(); ++i) given.lights[i].file = files[i];
    return given;
}

}  // namespace darkbox
