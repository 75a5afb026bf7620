#include "processing/pipeline/session_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"
#include "acquisition/frame/pixel_format.h"

namespace darkbox {

namespace fs = std::filesystem;

ResultFiles::ResultFiles(const fs::path& s)
    : calibration(s / "calibration/lights.json"),
      lights_lp(s / "calibration/lights.lp"),
      ball_picture(s / "calibration/ball.png"),
      calibration_summary(s / "calibration/summary.json"),
      normals(s / "results/normals.exr"),
      normals_png(s / "results/normals.png"),
      albedo(s / "results/albedo.exr"),
      albedo_png(s / "results/albedo.png"),
      confidence(s / "results/confidence.exr"),
      height(s / "results/height.exr"),
      surface(s / "results/surface.ply"),
      shadows(s / "results/shadows"),
      results_summary(s / "results/summary.json"),
      index(s / "texels/index.png"),
      texels(s / "texels/texels.json"),
      shading(s / "shading/shading_maps.exr"),
      shading_json(s / "shading/shading.json"),
      shading_albedo(s / "shading/albedo.exr"),
      shading_summary(s / "shading/summary.json"),
      results_folder(s / "results"),
      report(s / "report.html") {}

void require_made(const fs::path& file, const Session& session, const char* command) {
    if (!fs::exists(file))
        throw InputError(fmt::format("{} is not there yet", file.string()),
                         fmt::format("run 'darkbox {} {}' first", command, session.folder().string()));
}

std::vector<std::string> remove_derived(const Session& session, const std::vector<std::string>& folders) {
    std::vector<std::string> removed;
    std::error_code ignored;  // what cannot be removed cannot be written over either, and that is reported
    for (const std::string& folder : folders)
        if (fs::remove_all(session.folder() / folder, ignored) > 0 && !ignored) removed.push_back(folder);
    fs::remove(session.folder() / "report.html", ignored);
    return removed;
}

std::vector<FrameRecord> frames_of_kind(const Session& session, FrameKind kind) {
    std::vector<FrameRecord> frames;
    std::copy_if(session.frames().begin(), session.frames().end(), std::back_inserter(frames),
                 [kind](const FrameRecord& frame) { return frame.kind == kind; });
    return frames;
}

namespace {

bool of_one_photograph(const FrameRecord& a, const FrameRecord& b) {
    return a.kind == b.kind && a.lamp && a.lamp == b.lamp && a.lamp_name == b.lamp_name &&
           pixel_format_from_name(a.format) && a.format == b.format;
}

}  // namespace

std::vector<FrameRecord> photographs_of(const Session& session, FrameKind kind) {
    std::vector<FrameRecord> photographs;
    for (const FrameRecord& frame : session.frames()) {
        const auto same = [&](const FrameRecord& earlier) { return of_one_photograph(earlier, frame); };
        if (frame.kind == kind && std::none_of(photographs.begin(), photographs.end(), same))
            photographs.push_back(frame);
    }
    return photographs;
}

std::vector<FrameRecord> frames_of_photograph(const Session& session, const FrameRecord& photograph) {
    std::vector<FrameRecord> frames;
    for (const FrameRecord& frame : session.frames())
        if (frame.file == photograph.file || of_one_photograph(photograph, frame)) frames.push_back(frame);
    return frames;
}

bool same_controls(const FrameRecord& a, const FrameRecord& b) {
    const auto near = [](double p, double q) { return std::abs(p - q) <= 1e-6 * std::max(std::abs(p), std::abs(q)); };
    return near(a.exposure_s, b.exposure_s) && near(a.gain, b.gain) && a.width == b.width && a.height == b.height;
}

std::string basename_of(const FrameRecord& frame) { return fs::path(frame.file).filename().string(); }

std::optional<fs::path> extra_of(const Session& session, const char* name) {
    const auto& extras = session.extras();
    if (std::find(extras.begin(), extras.end(), name) == extras.end()) return std::nullopt;
    return session.path_of_extra(name);
}

}  // namespace darkbox
