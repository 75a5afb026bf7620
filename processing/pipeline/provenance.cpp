#include "processing/pipeline/provenance.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "acquisition/session/bag.h"
#include "acquisition/session/sha256.h"
#include "processing/formats/json_file.h"
#include "processing/formats/picture_metadata.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// The choices that a stage's summary keeps, as "normals.solver=robust". Nothing where the stage has not run.
void add_choices(const fs::path& summary, std::string_view stage, std::initializer_list<const char*> keys,
                 std::vector<std::string>& parameters) {
    std::error_code ignored;
    if (!fs::exists(summary, ignored)) return;
    const auto json = read_json(summary);
    for (const char* key : keys)
        if (const auto found = json.find(key); found != json.end())
            parameters.push_back(
                fmt::format("{}.{}={}", stage, key, found->is_string() ? found->get<std::string>() : found->dump()));
}

std::vector<std::string> choices_so_far(const Session& session) {
    const ResultFiles files(session.folder());
    std::vector<std::string> parameters;
    add_choices(files.calibration_summary, "calibrate", {"method", "intensity_origin"}, parameters);
    add_choices(files.results_summary, "normals", {"solver", "body", "gloss", "intensity_origin", "images"},
                parameters);
    add_choices(files.texels, "texels", {"texels"}, parameters);
    add_choices(files.shading_summary, "shade", {"levels"}, parameters);
    return parameters;
}

/// Empty where the normals have not been solved for.
std::string solver_of(const Session& session) {
    const fs::path summary = ResultFiles(session.folder()).results_summary;
    std::error_code ignored;
    return fs::exists(summary, ignored) ? read_json(summary).value("solver", "") : "";
}

PictureMetadata metadata_of(const Session& session, std::string_view what, const std::vector<std::string>& last) {
    const SessionInfo& info = session.info();
    std::vector<std::string> parameters = choices_so_far(session);
    parameters.insert(parameters.end(), last.begin(), last.end());
    PictureMetadata metadata{.object = info.object,
                             .inventory = info.record.inventory,
                             .dublin_core = info.record.dublin_core,
                             .software = "darkbox " DARKBOX_VERSION,
                             .provenance = {}};
    metadata.provenance = {{"Version", DARKBOX_VERSION},
                           {"Picture", std::string(what)},
                           {"Session", session.folder().filename().string()},
                           {"SessionManifestSha256", sha256_of_file(session.folder() / manifest_name)},
                           {"Source", info.source},
                           {"Captured", info.created},
                           {"Rig", info.rig},
                           {"Camera", info.camera},
                           {"Solver", solver_of(session)},
                           {"Parameters", fmt::format("{}", fmt::join(parameters, "; "))}};
    return metadata;
}

}  // namespace

void describe_pictures(const Session& session, std::string_view what, const std::vector<fs::path>& pictures,
                       const std::vector<std::string>& parameters) {
    if (pictures.empty()) return;
    const PictureMetadata metadata = metadata_of(session, what, parameters);
    for (const fs::path& picture : pictures) embed_metadata(picture, metadata);
}

}  // namespace darkbox
