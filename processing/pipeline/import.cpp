#include "processing/pipeline/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "acquisition/frame/error.h"
#include "acquisition/session/session_writer.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/picture.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/png.h"
#include "processing/pipeline/given_lights.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/survey.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// A photograph that was read whole, and what the session will say of it.
struct Inspected {
    fs::path source;
    FrameRecord record;
    bool profile = false;  ///< the curve came from an embedded profile
};

/// An extra payload: its name in the session and its bytes.
struct Extra {
    std::string name;
    std::vector<std::byte> bytes;
};

TransferCurve curve_of(const Picture& picture, ImportTransfer wanted) {
    if (wanted == ImportTransfer::linear) return TransferCurve::linear;
    if (wanted == ImportTransfer::srgb) return TransferCurve::srgb;
    if (picture.embedded)
        return *picture.embedded == EmbeddedCurve::linear ? TransferCurve::linear : TransferCurve::srgb;
    return picture.bit_depth > 8 ? TransferCurve::linear : TransferCurve::srgb;
}

Inspected inspect(const fs::path& source, FrameKind kind, ImportTransfer transfer) {
    const Picture picture = read_picture(source);
    Inspected inspected{source, {}, picture.embedded.has_value()};
    FrameRecord& record = inspected.record;
    record.kind = kind;
    record.format = name(picture.format);
    record.width = picture.samples.cols;
    record.height = picture.samples.rows;
    record.bit_depth = picture.bit_depth;
    record.transfer = curve_of(picture, transfer);
    record.verification = "imported: read whole, not checked against a lamp";
    return inspected;
}

void require_one_size(const Inspected& first, const Inspected& other) {
    const FrameRecord &a = first.record, &b = other.record;
    if (a.width != b.width || a.height != b.height)
        throw InputError(fmt::format("{} is {}x{} pixels but {} is {}x{}", other.source.string(), b.width, b.height,
                                     first.source.string(), a.width, a.height),
                         "give photographs of one camera in one place, all of one size");
}

void require_different(const std::vector<fs::path>& files) {
    std::set<fs::path> seen;
    for (const fs::path& file : files)
        if (!seen.insert(fs::absolute(file).lexically_normal()).second)
            throw InputError(fmt::format("{} is given twice", file.string()), "name each folder of photographs once");
}

/// The file's own name; where another has it already, with the names of its folders before it, as many as it takes.
std::string unique_name(const fs::path& file, std::set<std::string>& names) {
    const fs::path whole = fs::absolute(file).lexically_normal();
    std::string name = whole.filename().string();
    for (fs::path folder = whole.parent_path(); !names.insert(name).second; folder = folder.parent_path())
        name = folder.filename().string() + "_" + name;
    return name;
}

/// Every photograph is read once before anything is written, so that a bad one leaves no half session.
std::vector<Inspected> inspect_all(const std::vector<fs::path>& files, FrameKind kind, const std::string& folder,
                                   const ImportOptions& options, const WorkContext& work) {
    require_different(files);
    std::vector<Inspected> all;
    std::set<std::string> names;
    for (const fs::path& file : files) {
        step(work, {"reading photographs", all.size(), files.size(), file.filename().string()});
        Inspected one = inspect(file, kind, options.transfer);
        one.record.lamp_name = unique_name(file, names);
        one.record.file = folder + one.record.lamp_name;
        one.record.lamp = LampId{static_cast<std::uint32_t>(all.size())};
        if (!all.empty()) require_one_size(all.front(), one);
        all.push_back(std::move(one));
    }
    return all;
}

/// Frame i of a folder that goes beside the object's is lit as frame i of the object.
void require_frame_for_frame(const Survey& beside, std::size_t lit, const std::optional<fs::path>& folder,
                             const char* thing) {
    if (folder && beside.frames.size() != lit)
        throw InputError(fmt::format("there are {} photographs of the {} in {} but {} of the object",
                                     beside.frames.size(), thing, folder->string(), lit),
                         fmt::format("photograph the {} under the same lamps in the same order: frame i of one is lit "
                                     "as frame i of the other",
                                     thing));
}

/// The mask asked for, else the one that lies beside the photographs.
std::optional<fs::path> mask_of(const Survey& survey, const std::optional<fs::path>& asked_for, const char* option) {
    if (asked_for) return asked_for;
    if (survey.masks.size() <= 1) return survey.masks.empty() ? std::nullopt : std::optional(survey.masks.front());
    const auto plain = std::find_if(survey.masks.begin(), survey.masks.end(),
                                    [](const fs::path& mask) { return mask.filename() == "mask.png"; });
    if (plain != survey.masks.end()) return *plain;
    throw InputError(fmt::format("there are {} masks, among them {} and {}", survey.masks.size(),
                                 survey.masks[0].string(), survey.masks[1].string()),
                     fmt::format("say which one with {}", option));
}

/// The mask's bytes when it is a PNG already, else a PNG of it. It must fit the photographs.
Extra mask_extra(const fs::path& path, const char* name, const Inspected& first) {
    const cv::Mat1b mask = read_mask(path);
    const FrameRecord& frame = first.record;
    if (mask.cols != frame.width || mask.rows != frame.height)
        throw InputError(fmt::format("the mask {} is {}x{} pixels but {} is {}x{}", path.string(), mask.cols, mask.rows,
                                     first.source.string(), frame.width, frame.height),
                         "give a mask of the photographs' size");
    std::vector<std::byte> bytes = read_file(path);
    if (require_picture_format(bytes, path.string()) != PictureFormat::png) bytes = encode_png(mask);
    return {name, std::move(bytes)};
}

bool ball_is_given(const ImportOptions& options) {
    return options.ball_images || !options.balls.empty() || options.ball_mask;
}

/// Light files to keep: those asked for, else those in the folder, unless a ball is to tell the lights.
std::vector<Extra> light_extras(const Survey& survey, const ImportOptions& options, const std::vector<Inspected>& lit) {
    const auto lights = options.lights ? options.lights : ball_is_given(options) ? std::nullopt : survey.lights;
    if (!lights) return {};
    const auto intensities = options.lights ? std::nullopt : survey.intensities;
    std::vector<std::string> names;
    for (const Inspected& frame : lit) names.push_back(frame.record.lamp_name);
    lights_for(names, *lights, intensities);
    const bool lp = read_lights(*lights).form == LightFileForm::lp;
    std::vector<Extra> extras{{lp ? given_lp : given_plain_lights, read_file(*lights)}};
    if (intensities) extras.push_back({given_intensities, read_file(*intensities)});
    return extras;
}

Extra balls_extra(const std::vector<Ball>& balls) {
    nlohmann::json list = nlohmann::json::array();
    for (const Ball& ball : balls) list.push_back({{"x", ball.x}, {"y", ball.y}, {"radius", ball.radius}});
    const std::string text = nlohmann::json{{"balls", list}}.dump(2) + "\n";
    const auto bytes = std::as_bytes(std::span(text));
    return {given_ball, {bytes.begin(), bytes.end()}};
}

/// What was found in the folders of the object, of the ball and of the diffuse plane.
struct Findings {
    Survey object, ball, flat;
    std::vector<Inspected> lit, ball_frames, flat_frames;

    std::vector<Inspected> all_frames() const {
        std::vector<Inspected> all = lit;
        all.insert(all.end(), ball_frames.begin(), ball_frames.end());
        all.insert(all.end(), flat_frames.begin(), flat_frames.end());
        return all;
    }
};

/// Reads every photograph of every folder once.
Findings find_photographs(const ImportOptions& options, const WorkContext& work) {
    Findings found;
    found.object = survey_folders(options.folders, options.layout);
    if (options.ball_images) found.ball = survey_folders({*options.ball_images}, ImportLayout::plain);
    if (options.flat_images) found.flat = survey_folders({*options.flat_images}, ImportLayout::plain);
    require_frame_for_frame(found.ball, found.object.frames.size(), options.ball_images, "ball");
    require_frame_for_frame(found.flat, found.object.frames.size(), options.flat_images, "flat field");
    found.lit = inspect_all(found.object.frames, FrameKind::lit, "frames/", options, work);
    found.ball_frames = inspect_all(found.ball.frames, FrameKind::ball, "frames/ball/", options, work);
    found.flat_frames = inspect_all(found.flat.frames, FrameKind::flat, "frames/flat/", options, work);
    if (!found.flat_frames.empty()) require_one_size(found.lit.front(), found.flat_frames.front());
    return found;
}

/// A circle given by hand outranks a mask that merely lies there.
std::optional<fs::path> ball_mask_of(const Findings& found, const ImportOptions& options) {
    if (!options.balls.empty() && !options.ball_mask) return std::nullopt;
    return mask_of(found.ball, options.ball_mask, "--ball-mask");
}

std::vector<Extra> extras_of(const Findings& found, const ImportOptions& options) {
    std::vector<Extra> extras = light_extras(found.object, options, found.lit);
    const Inspected& ball = found.ball_frames.empty() ? found.lit.front() : found.ball_frames.front();
    if (const auto mask = mask_of(found.object, options.mask, "--mask"))
        extras.push_back(mask_extra(*mask, object_mask, found.lit.front()));
    if (const auto mask = ball_mask_of(found, options)) extras.push_back(mask_extra(*mask, ball_mask, ball));
    if (!options.balls.empty()) extras.push_back(balls_extra(options.balls));
    if (found.object.truth) extras.push_back({given_truth, read_file(*found.object.truth)});
    return extras;
}

std::string transfer_note(const std::vector<Inspected>& frames, ImportTransfer wanted) {
    const auto srgb = std::count_if(frames.begin(), frames.end(),
                                    [](const Inspected& f) { return f.record.transfer == TransferCurve::srgb; });
    const std::string curves = srgb == 0 ? "linear"
                               : srgb == std::ssize(frames)
                                   ? "sRGB"
                                   : fmt::format("sRGB for {} frames, linear for {}", srgb, std::ssize(frames) - srgb);
    if (wanted != ImportTransfer::automatic) return fmt::format("transfer curve: {}, as asked for", curves);
    const bool profile = std::any_of(frames.begin(), frames.end(), [](const Inspected& f) { return f.profile; });
    return fmt::format("transfer curve: {}, chosen by {}", curves, profile ? "the embedded profile" : "the bit depth");
}

bool holds(const std::vector<Extra>& extras, std::string_view name) {
    return std::any_of(extras.begin(), extras.end(), [name](const Extra& e) { return e.name == name; });
}

std::vector<std::string> notes_of(const Findings& found, const ImportOptions& options,
                                  const std::vector<Extra>& extras) {
    std::vector<std::string> notes{"layout: " + found.object.layout, transfer_note(found.lit, options.transfer)};
    if (found.lit.size() < 3)
        notes.push_back(
            fmt::format("warning: only {} photographs: photometric stereo needs three lights", found.lit.size()));
    if (!holds(extras, object_mask)) notes.push_back("no mask was given: the object is told from the dark background");
    if (!options.ball_mask && holds(extras, ball_mask))
        notes.push_back("the mask beside the ball's photographs tells the ball's outline");
    if (!options.lights && found.object.lights && ball_is_given(options))
        notes.push_back(
            fmt::format("{} was left aside: the ball tells the lights", found.object.lights->filename().string()));
    return notes;
}

Session write_session(const SessionInfo& info, const fs::path& out, const std::vector<Inspected>& frames,
                      const std::vector<Extra>& extras, const WorkContext& work) {
    SessionWriter writer = SessionWriter::create(out, info);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        step(work, {"copying photographs", i, frames.size(), frames[i].source.filename().string()});
        writer.add(read_file(frames[i].source), frames[i].record);
    }
    for (const Extra& extra : extras) writer.add_extra(extra.name, extra.bytes);
    return writer.seal();
}

/// The folder's own name also for "photos/" and ".".
std::string name_of_folder(const fs::path& folder) {
    const fs::path whole = fs::weakly_canonical(folder);
    return whole.has_filename() ? whole.filename().string() : whole.parent_path().filename().string();
}

}  // namespace

void ImportOptions::validate() const {
    if (folders.empty()) throw InputError("folders is empty: nothing to import", "give a folder of photographs");
    if (out.empty()) throw InputError("out is empty: nowhere to write the session", "say where with --out");
    for (const Ball& ball : balls)
        if (!(std::isfinite(ball.x) && std::isfinite(ball.y) && ball.radius > 0 && std::isfinite(ball.radius)))
            throw InputError(fmt::format("ball is {}, {}, {}: x and y must be finite and the radius above 0 pixels",
                                         ball.x, ball.y, ball.radius),
                             "give the ball as X,Y,R in pixels");
    if (ball_diameter_mm && !(std::isfinite(*ball_diameter_mm) && *ball_diameter_mm > 0))
        throw InputError(fmt::format("ball_diameter_mm is {}", *ball_diameter_mm), "allowed: more than 0 mm");
}

Session import_photographs(const ImportOptions& options, const WorkContext& work) {
    options.validate();
    const Findings found = find_photographs(options, work);
    const std::vector<Extra> extras = extras_of(found, options);
    const std::vector<Inspected> all = found.all_frames();

    SessionInfo info;
    info.object = options.object.empty() ? name_of_folder(options.folders.front()) : options.object;
    info.created = iso8601_now();
    info.source = "import";
    info.record = options.record;
    info.planned_shots = static_cast<int>(all.size());
    info.notes = notes_of(found, options, extras);
    if (options.ball_diameter_mm) {
        info.geometry.emplace();
        info.geometry->ball_diameter_mm = options.ball_diameter_mm;
    }
    std::error_code ignored;
    const bool was_there = fs::exists(options.out, ignored);
    try {
        return write_session(info, options.out, all, extras, work);
    } catch (...) {
        if (!was_there)  // what went wrong is the news, not that nothing can be removed
            fs::remove_all(options.out, ignored);
        throw;
    }
}

}  // namespace darkbox
