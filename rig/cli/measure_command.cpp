#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "acquisition/frame/error.h"
#include "processing/formats/map_files.h"
#include "processing/formats/picture.h"
#include "processing/transfer/measures.h"
#include "rig/cli/commands.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct MeasureArguments {
    fs::path source_normals;
    fs::path source_albedo;
    fs::path source_mask;
    fs::path target_normals;
    fs::path target_mask;
    fs::path coordinates;
    fs::path picture;
    MeasureOptions options;
};

NormalMap load_normals(const fs::path& file, const fs::path& mask) {
    return mask.empty() ? read_normal_map(file) : read_normal_map(file, read_mask(mask));
}

/// Pictures are judged as displayed. Radiance has no white of its own: both pictures then take the source's.
TransferMeasures measured(const MeasureArguments& a, const WorkContext& work) {
    const NormalMap normals = load_normals(a.source_normals, a.source_mask);
    const NormalMap target = load_normals(a.target_normals, a.target_mask);
    const AlbedoMap albedo = read_albedo_map(a.source_albedo, normals.valid);
    const float white = a.source_albedo.extension() == ".exr" ? white_level(albedo) : 1.0F;
    const Appearance source = appearance_of(normals, albedo, white);
    if (!a.coordinates.empty())
        return measure_coordinates(source, target, read_coordinates(a.coordinates), a.options, work);
    const AlbedoMap picture = read_albedo_map(a.picture, target.valid);
    return measure_picture(source, appearance_of(target, picture, a.picture.extension() == ".exr" ? white : 1.0F),
                           a.options, work);
}

struct Row {
    const char* key;
    const char* meaning;
    std::optional<double> value;
};

std::vector<Row> rows(const TransferMeasures& m) {
    return {{"joint_energy", "patches with normals, to the nearest", m.joint_energy},
            {"patch_energy", "patches, to the nearest", m.patch_energy},
            {"seam", "mismatch with the source's continuation", m.seam},
            {"angle_mean_deg", "target normal to the source's, mean", m.angle_mean_deg},
            {"angle_p95_deg", "  and 95th percentile", m.angle_p95_deg},
            {"colour_error", "blurred colour, to that expected of the normal", m.colour_error},
            {"histogram_distance", "Lab histogram, to that expected", m.histogram_distance},
            {"coherence", "share of continued source coordinates", m.coherence},
            {"cover", "share of source pixels used", m.cover},
            {"sharpness", "1 = as sharp as the source", m.sharpness},
            {"background", "source pixels used that are not valid", m.background}};
}

CommandResult run(const MeasureArguments& a, const WorkContext& work) {
    if (a.coordinates.empty() == a.picture.empty())
        throw InputError("measure-transfer needs one result", "give --coordinates FILE or --picture FILE");
    CommandResult result;
    for (const Row& row : rows(measured(a, work))) {
        result.json[row.key] = row.value ? Json(*row.value) : Json();
        result.text += fmt::format("{}{:<19} {:>8}  {}", result.text.empty() ? "" : "\n", row.key,
                                   row.value ? fmt::format("{:.3f}", *row.value) : "-", row.meaning);
    }
    return result;
}

}  // namespace

void add_measure_command(CommandLine& line) {
    const auto a = std::make_shared<MeasureArguments>();
    CLI::App& command = line.add("measure-transfer", "Measure a transferred texture, darkbox's or anybody's",
                                 "darkbox measure-transfer --source-normals n.png --source-albedo a.png "
                                 "--target-normals t.png --coordinates moved/coordinates.png",
                                 [a](const WorkContext& work) { return run(*a, work); });
    command.add_option("--source-normals", a->source_normals, "The source's normals as PNG or EXR")->required();
    command.add_option("--source-albedo", a->source_albedo, "  and its unshaded colours")->required();
    command.add_option("--source-mask", a->source_mask, "  and a picture that is white on it");
    command.add_option("--target-normals", a->target_normals, "The target's normals as PNG or EXR")->required();
    command.add_option("--target-mask", a->target_mask, "  and a picture that is white on it");
    command.add_option("--coordinates", a->coordinates, "The result as 16-bit PNG: red, green = source x, y");
    command.add_option("--picture", a->picture, "Or as a picture only: what needs coordinates is left out");
    command.add_option("--window", a->options.window, "Side of the patches, pixels, odd")->capture_default_str();
    command.add_option("--stride", a->options.stride, "Pixels between patches")->capture_default_str();
}

}  // namespace darkbox
