#include "processing/pipeline/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/png.h"
#include "processing/formats/ptm_file.h"
#include "processing/maps/parallel.h"
#include "processing/maps/photo_source.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t photographs_at_once = 4;
constexpr std::size_t band_bytes = std::size_t{128} << 20;  ///< of photographs in memory while texture maps are fitted

cv::Mat sixteen_bit(const cv::Mat3f& image, double scale) {
    cv::Mat words;
    image.convertTo(words, CV_16U, 65535.0 * scale);
    return words;
}

/// All lit photographs in order, a few of them in memory at a time: `body(index, radiance)`.
template <class Body>
void for_each_photograph(const Session& session, const char* stage, const WorkContext& work, Body body) {
    const std::vector<FrameRecord> frames = photographs_of(session, FrameKind::lit);
    for (std::size_t first = 0; first < frames.size(); first += photographs_at_once) {
        const std::size_t last = std::min(first + photographs_at_once, frames.size());
        step(work, {stage, first, frames.size(), basename_of(frames[first])});
        const std::vector<FrameRecord> some(frames.begin() + static_cast<std::ptrdiff_t>(first),
                                            frames.begin() + static_cast<std::ptrdiff_t>(last));
        const std::vector<Radiance> radiances = read_radiances(session, some, work);
        for (std::size_t i = first; i < last; ++i) body(i, radiances[i - first]);
    }
}

void require_light_for_each(const Session& session, const Lights& lights) {
    const std::size_t frames = photographs_of(session, FrameKind::lit).size();
    if (frames != lights.size())
        throw InputError(
            fmt::format("{} has {} lit frames but {} lights", session.folder().string(), frames, lights.size()),
            "calibrate the session again");
}

double peak(const cv::Mat3f& image) {
    double top = 0;
    cv::minMaxLoc(image.reshape(1), nullptr, &top);
    return top;
}

/// DiLiGenT: 001.png..., and a line per photograph in each list. Lights that cannot be used are left out. A photograph
/// brighter than 16 bits hold is scaled down, and its intensity with it, by which readers divide.
void export_diligent(const Session& session, const fs::path& out, const WorkContext& work) {
    const Lights all = load_lights(session);
    require_light_for_each(session, all);
    write_png(out / "mask.png", load_mask(session, work));
    Lights lights;
    std::string names;
    std::vector<fs::path> pictures;
    for_each_photograph(session, "exporting", work, [&](std::size_t i, const Radiance& photograph) {
        if (!all[i].used) return;
        lights.push_back(all[i]);
        const double scale = 1.0 / std::max(1.0, peak(photograph.image));
        lights.back().intensity *= scale;
        const std::string name = fmt::format("{:03}.png", lights.size());
        write_png(out / name, sixteen_bit(photograph.image, scale));
        names += name + "\n";
        pictures.push_back(out / name);
    });
    describe_pictures(session, "photograph, linear", pictures);
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

/// Of some rows of all photographs.
Ptm fitted_band(const PhotoBand& band, const Lights& lights, PtmModel model, const WorkContext& work) {
    PtmFit fit({band.cols(), band.rows()}, model, lights);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        const Eigen::Vector3d& e = lights[i].intensity;
        cv::Mat3f relative;
        cv::divide(radiance_of(band.photos[i]), cv::Scalar(e[0], e[1], e[2]), relative);
        fit.add(as_shown(relative), i, work);
    }
    return fit.result();
}

/// The photographs pass by in bands of rows: what stays in memory is the result, 9 floats a pixel for lrgb and 18 for
/// rgb.
Ptm fitted_ptm(const Session& session, const Lights& lights, PtmModel model, const WorkContext& work) {
    require_light_for_each(session, lights);
    FrameBands frames(session, photographs_of(session, FrameKind::lit));
    const cv::Size size = frames.size();
    const int most_rows = static_cast<int>(std::max<std::size_t>(1, band_bytes / frames.bytes_per_row()));
    Ptm whole{model, {}, {}};
    for (cv::Mat& coefficient : whole.coefficient)
        coefficient.create(size, model == PtmModel::rgb ? CV_32FC3 : CV_32FC1);
    if (model == PtmModel::lrgb) whole.colour.create(size);
    PhotoBand band;
    for (int first = 0; first < size.height; first += most_rows) {
        const int last = std::min(first + most_rows, size.height);
        step(work, {"fitting", static_cast<std::size_t>(first), static_cast<std::size_t>(size.height), ""});
        on_threads_of(work, [&] { frames.read_next(last - first, band); });
        const Ptm fitted = fitted_band(band, lights, model, work);
        for (std::size_t t = 0; t < ptm_terms; ++t)
            fitted.coefficient[t].copyTo(whole.coefficient[t].rowRange(first, last));
        if (model == PtmModel::lrgb) fitted.colour.copyTo(whole.colour.rowRange(first, last));
    }
    return whole;
}

void export_web(const Session& session, PtmModel model, const fs::path& out, const WorkContext& work) {
    const Lights lights = load_lights(session);
    describe_pictures(session, "polynomial texture map",
                      write_relight_web(out, fitted_ptm(session, lights, model, work), lights));
}

}  // namespace

ExportFormat export_format(std::string_view name) {
    if (name == "lp") return ExportFormat::lp;
    if (name == "diligent") return ExportFormat::diligent;
    if (name == "ptm") return ExportFormat::ptm;
    if (name == "ptm-rgb") return ExportFormat::ptm_rgb;
    if (name == "relight") return ExportFormat::relight;
    if (name == "relight-rgb") return ExportFormat::relight_rgb;
    if (name == "ply") return ExportFormat::ply;
    throw InputError(fmt::format("there is no export format '{}'", name),
                     "choose one of: lp, diligent, ptm, ptm-rgb, relight, relight-rgb, ply");
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
        case ExportFormat::relight:
            export_web(session, PtmModel::lrgb, out, work);
            return;
        case ExportFormat::relight_rgb:
            export_web(session, PtmModel::rgb, out, work);
            return;
        case ExportFormat::ply:
            require_made(files.surface, session, "normals");
            write_file(out, read_file(files.surface));
            return;
    }
}

}  // namespace darkbox
