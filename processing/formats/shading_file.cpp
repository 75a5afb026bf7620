#include <fmt/format.h>

#include "processing/formats/exr.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

ordered_json samples_of(const ShadingMaps& maps) {
    ordered_json rows = ordered_json::array();
    for (int k = 0; k < maps.texels; ++k)
        rows.push_back(std::vector<int>(maps.samples[k], maps.samples[k] + maps.levels));
    return rows;
}

ordered_json mean_albedo_of(const ShadingMaps& maps) {
    ordered_json rows = ordered_json::array();
    for (int k = 0; k < maps.texels; ++k) {
        const cv::Vec3f& mean = maps.mean_albedo(k, 0);
        rows.push_back({mean[0], mean[1], mean[2]});
    }
    return rows;
}

ShadingMaps maps_in(const nlohmann::json& json) {
    ShadingMaps maps;
    maps.texels = json.at("texels").get<int>();
    maps.levels = json.at("levels").get<int>();
    maps.samples.create(maps.texels, maps.levels);
    maps.mean_albedo.create(maps.texels, 1);
    for (int k = 0; k < maps.texels; ++k) {
        const auto row = static_cast<std::size_t>(k);
        for (int i = 0; i < maps.levels; ++i)
            maps.samples(k, i) = json.at("samples").at(row).at(static_cast<std::size_t>(i)).get<int>();
        for (int c = 0; c < 3; ++c)
            maps.mean_albedo(k, 0)[c] = json.at("mean_albedo").at(row).at(static_cast<std::size_t>(c)).get<float>();
    }
    return maps;
}

}  // namespace

void write_shading_maps(const fs::path& exr, const fs::path& json, const ShadingMaps& maps) {
    write_exr(exr, maps.radiance);
    write_json(json, {{"what", "S(k, r): row k - 1 of the EXR is texel k, column i is r = i / (levels - 1)"},
                      {"texels", maps.texels},
                      {"levels", maps.levels},
                      {"samples", samples_of(maps)},
                      {"mean_albedo", mean_albedo_of(maps)}});
}

ShadingMaps read_shading_maps(const fs::path& exr, const fs::path& json) {
    const nlohmann::json parsed = read_json(json);
    ShadingMaps maps = reading_keys(json, "a description of shading maps", [&] { return maps_in(parsed); });
    maps.radiance = read_exr_colour(exr);
    if (maps.radiance.rows != maps.texels || maps.radiance.cols != maps.levels)
        throw InputError(fmt::format("{} holds {}x{} entries, but {} says {} texels of {} levels", exr.string(),
                                     maps.radiance.rows, maps.radiance.cols, json.string(), maps.texels, maps.levels),
                         "run 'darkbox shade' again");
    return maps;
}

}  // namespace darkbox
