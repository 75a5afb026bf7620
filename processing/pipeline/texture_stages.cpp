#include <fmt/format.h>

#include <numeric>

#include "acquisition/frame/error.h"
#include "processing/formats/json_file.h"
#include "processing/formats/map_files.h"
#include "processing/pipeline/lit_photos.h"
#include "processing/pipeline/provenance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/session_geometry.h"
#include "processing/pipeline/shade_stage.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/summary_json.h"
#include "processing/shading/shading_bands.h"

namespace darkbox {
namespace {

struct Maps {
    NormalMap normals;
    AlbedoMap albedo;
};

Maps read_maps(const Session& session) {
    const ResultFiles files(session.folder());
    require_made(files.normals, session, "normals");
    require_made(files.albedo, session, "normals");
    Maps maps{read_normal_map(files.normals), {}};
    maps.albedo = read_albedo_map(files.albedo, maps.normals.valid);
    return maps;
}

IndexMap read_index(const Session& session) {
    const ResultFiles files(session.folder());
    require_made(files.index, session, "texels");
    return read_index_map(files.index);
}

}  // namespace

TexelsSummary run_texels(const Session& session, const TexelOptions& options, const WorkContext& work) {
    options.validate();
    const ResultFiles files(session.folder());
    TexelsSummary summary;
    Stopwatch watch;
    const Maps maps = read_maps(session);
    summary.seconds.read = watch.lap();
    step(work, {"clustering texels", 0, 1, ""});
    const TexelResult clustered = cluster_texels(maps.albedo, options, work);
    watch.lap();
    summary.seconds.solve = clustered.seconds;
    summary.texels = clustered.index.texels;
    summary.within_cluster_variance = clustered.within_cluster_variance;
    summary.variance_explained = clustered.variance_explained;
    remove_derived(session, {"shading"});
    write_index_map(files.index, clustered.index);
    summary.seconds.write = watch.lap();
    write_json(files.texels, to_json(summary));
    describe_pictures(session, "texels", {files.index});
    step(work, {"clustering texels", 1, 1, ""});
    return summary;
}

ShadeSummary run_shade(const Session& session, const ShadingOptions& options, const WorkContext& work) {
    return run_shade(session, options, ShadingBands{}, work);
}

ShadeSummary run_shade(const Session& session, const ShadingOptions& options, const ShadingBands& bands,
                       const WorkContext& work) {
    options.validate();
    bands.validate();
    const ResultFiles files(session.folder());
    const Lights lights = load_lights(session);
    ShadeSummary summary;
    Stopwatch watch;
    const Maps maps = read_maps(session);
    const IndexMap index = read_index(session);
    LitPhotos photos(session);
    summary.seconds.read = watch.lap();
    step(work, {"measuring shading maps", 0, 1, ""});
    ShadingOptions with_geometry = options;
    with_geometry.geometry = scene_geometry(files);
    const ShadingResult shaded =
        shading_maps(photos, lights, maps.normals, maps.albedo, index, with_geometry, bands, work);
    watch.lap();
    summary.seconds.solve = shaded.seconds;
    summary.texels = shaded.maps.texels;
    summary.levels = shaded.maps.levels;
    summary.samples =
        std::accumulate(shaded.maps.samples.begin(), shaded.maps.samples.end(), std::size_t{0},
                        [](std::size_t sum, int samples) { return sum + static_cast<std::size_t>(samples); });
    write_shading_maps(files.shading, files.shading_json, shaded.maps);
    write_albedo_map(files.shading_albedo, shaded.albedo);
    summary.seconds.write = watch.lap();
    write_json(files.shading_summary, to_json(summary));
    step(work, {"measuring shading maps", 1, 1, ""});
    return summary;
}

RelightScene load_scene(const Session& session) {
    const ResultFiles files(session.folder());
    const Maps maps = read_maps(session);
    RelightScene scene{maps.normals, maps.albedo, read_index(session), {}};
    require_made(files.shading, session, "shade");
    require_made(files.shading_json, session, "shade");
    scene.shading = read_shading_maps(files.shading, files.shading_json);
    return scene;
}

RelightScene load_shaded_scene(const Session& session) {
    const ResultFiles files(session.folder());
    RelightScene scene = load_scene(session);
    require_made(files.shading_albedo, session, "shade");
    scene.albedo = read_albedo_map(files.shading_albedo, scene.normals.valid);
    return scene;
}

SceneGeometry load_geometry(const Session& session) {
    const ResultFiles files(session.folder());
    require_made(files.calibration, session, "calibrate");
    SceneGeometry geometry = scene_geometry(files);
    if (!geometry.view)
        throw InputError(fmt::format("{} does not know the scale of its pictures, which a near lamp needs",
                                     session.folder().string()),
                         "calibrate again with --ball-diameter MM, or give mm_per_pixel in rig.toml");
    return geometry;
}

}  // namespace darkbox
