#include "processing/pipeline/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/png.h"
#include "processing/formats/ptm_file.h"
#include "processing/formats/srgb.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t photographs_at_once = 4;

cv::Mat sixteen_bit(const cv::Mat3f& image) {
    cv::Mat words;
    image.convertTo(words, CV_16U, 65535.0);
    return words;
}

/// DiLiGenT: 001.png..., and a line per photograph in each list. Lights that cannot be used are left out.
void export_diligent(const Session& session, const fs::path& out, const WorkContext& work) {
    const Lights all = load_lights(session);
    const PhotoStack stack = load_stack(session, work);
    Lights lights;
    std::string names;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (!all[i].used) continue;
        step(work, {"exporting", i, all.size(), stack.files[i]});
        lights.push_back(all[i]);
        const std::string name = fmt::format("{:03}.png", lights.size());
        write_png(out / name, sixteen_bit(stack.images[i]));
        names += name + "\n";
    }
    write_png(out / "mask.png", stack.mask);
    write_light_directions(out / "light_directions.txt", lights);
    write_light_intensities(out / "light_intensities.txt", lights);
    write_file(out / "filenames.txt", names);
}

cv::Mat3f as_shown(const cv::Mat3f& linear) {
    cv::Mat3f encoded(linear.size());
    for (int y = 0; y < linear.rows; ++y)
        for (int x = 0; x < linear.cols; ++x)
            for (int c = 0; c < 3; ++c) encoded(y, x)[c] = srgb_from_linear(std::clamp(linear(y, x)[c], 0.0F, 1.0F));
    return encoded;
}

/// Photographs are read a few at a time.
Ptm fitted_ptm(const Session& session, const Lights& lights, PtmModel model, const WorkContext& work) {
    const std::vector<FrameRecord> frames = frames_of_kind(session, FrameKind::lit);
    if (frames.size() != lights.size())
        throw InputError(
            fmt::format("{} has {} lit frames but {} lights", session.folder().string(), frames.size(), lights.size()),
            "calibrate the session again");
    PtmFit fit({frames.front().width, frames.front().height}, model, lights);
    for (std::size_t first = 0; first < frames.size(); first += photographs_at_once) {
        const std::size_t last = std::min(first + photographs_at_once, frames.size());
        step(work, {"fitting", first, frames.size(), basename_of(frames[first])});
        const std::vector<FrameRecord> some(frames.begin() + static_cast<std::ptrdiff_t>(first),
                                            frames.begin() + static_cast<std::ptrdiff_t>(last));
        const std::vector<Radiance> radiances = read_radiances(session, some, work);
        for (std::size_t i = first; i < last; ++i) {
            const Eigen::Vector3d& e = lights[i].intensity;
            if (!lights[i].used) continue;
            cv::Mat3f relative;
            cv::divide(radiances[i - first].image, cv::Scalar(e[0], e[1], e[2]), relative);
            fit.add(as_shown(relative), i, work);
        }
    }
    return fit.result();
}

}  // namespace

ExportFormat export_format(std::string_view name) {
    if (name == "lp") return ExportFormat::lp;
    if (name == "diligent") return ExportFormat::diligent;
    if (name == "ptm") return ExportFormat::ptm;
    if (name == "ptm-rgb") return ExportFormat::ptm_rgb;
    if (name == "relight") return ExportFormat::relight;
    if (name == "ply") return ExportFormat::ply;
    throw InputError(fmt::format("there is no export format '{}'", name),
                     "choose one of: lp, diligent, ptm, ptm-rgb, relight, ply");
}

void export_session(const Session& session, ExportFormat format, const fs::path& out, const WorkContext& work) {
    const ResultFiles files(session.folder());
    switch (format) {
        case ExportFormat::lp:
            write_lp(out, load_lights(session));
            return;
        case ExportFormat::diligent:
            export_diligent(session, out, work);
            return;
        case ExportFormat::ptm:
            write_ptm(out, fitted_ptm(session, load_lights(session), PtmModel::lrgb, work));
            return;
        case ExportFormat::ptm_rgb:
            write_ptm(out, fitted_ptm(session, load_lights(session), PtmModel::rgb, work));
            return;
        case ExportFormat::relight: {
            const Lights lights = load_lights(session);
            write_relight_web(out, fitted_ptm(session, lights, PtmModel::lrgb, work), lights);
            return;
        }
        case ExportFormat::ply:
            require_made(files.surface, session, "normals");
            write_file(out, read_file(files.surface));
            return;
    }
}

}  // namespace darkbox
