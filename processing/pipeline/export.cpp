#include "processing/pipeline/export.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/png.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

ExportFormat export_format(std::string_view name) {
    if (name == "lp") return ExportFormat::lp;
    if (name == "diligent") return ExportFormat::diligent;
    if (name == "ply") return ExportFormat::ply;
    throw InputError(fmt::format("there is no export format '{}'", name), "choose one of: lp, diligent, ply");
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
        case ExportFormat::ply:
            require_made(files.surface, session, "normals");
            write_file(out, read_file(files.surface));
            return;
    }
}

}  // namespace darkbox
