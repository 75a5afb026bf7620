#include "processing/pipeline/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/formats/light_files.h"
#include "processing/formats/map_files.h"
#include "processing/pipeline/stages.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

AngularError summarise(std::vector<double> angles_deg) {
    std::sort(angles_deg.begin(), angles_deg.end());
    const auto at = [&](double share) {
        return angles_deg[static_cast<std::size_t>(share * static_cast<double>(angles_deg.size() - 1))];
    };
    AngularError error;
    error.count = angles_deg.size();
    error.mean_deg = std::accumulate(angles_deg.begin(), angles_deg.end(), 0.0) / static_cast<double>(error.count);
    error.median_deg = at(0.5);
    error.p95_deg = at(0.95);
    return error;
}

Eigen::Vector3d to_eigen(const cv::Vec3f& v) { return {v[0], v[1], v[2]}; }

std::optional<NormalMap> true_normals(const Session& session) {
    for (const std::string& extra : session.extras())
        if (extra.ends_with(".mat")) return read_normal_truth(session.path_of_extra(extra));
    const fs::path simulated = session.folder() / "truth" / "normals.exr";
    if (fs::exists(simulated)) return read_normal_map(simulated);
    return std::nullopt;
}

std::optional<AngularError> light_error(const Session& session, const fs::path& truth_file) {
    const Lights truth = read_lights(truth_file).lights;
    const Lights computed = load_lights(session);
    if (truth.size() != computed.size())
        throw InputError(fmt::format("{} has {} lights but the calibration has {}", truth_file.string(), truth.size(),
                                     computed.size()),
                         "calibrate the session again");
    std::vector<double> angles_deg;
    for (std::size_t i = 0; i < truth.size(); ++i)
        if (computed[i].used) angles_deg.push_back(angle_deg(truth[i].direction, computed[i].direction));
    if (angles_deg.empty()) return std::nullopt;
    return summarise(std::move(angles_deg));
}

}  // namespace

AngularError angular_error(const NormalMap& computed, const NormalMap& truth) {
    if (computed.normal.size() != truth.normal.size())
        throw InputError(fmt::format("the normals are {} x {} pixels, the truth {} x {}", computed.normal.cols,
                                     computed.normal.rows, truth.normal.cols, truth.normal.rows),
                         "compare maps of one size");
    std::vector<double> angles_deg;
    for (int y = 0; y < truth.normal.rows; ++y)
        for (int x = 0; x < truth.normal.cols; ++x)
            if (computed.valid(y, x) && truth.valid(y, x))
                angles_deg.push_back(angle_deg(to_eigen(computed.normal(y, x)), to_eigen(truth.normal(y, x))));
    if (angles_deg.empty()) throw InputError("no pixel is valid in both normal maps", "do both show the same object?");
    return summarise(std::move(angles_deg));
}

Evaluation evaluate_session(const Session& session, const std::optional<fs::path>& reference_lights,
                            const WorkContext& work) {
    work.tell({"evaluate", 0, 0, session.folder().string()});
    Evaluation evaluation;
    if (const auto truth = true_normals(session)) {
        const fs::path computed = session.folder() / "results" / "normals.exr";
        if (!fs::exists(computed))
            throw InputError(session.folder().string() + " has no normals yet",
                             fmt::format("run: darkbox process {}", session.folder().string()));
        evaluation.normals = angular_error(read_normal_map(computed), *truth);
    }
    const fs::path simulated_lights = session.folder() / "truth" / "lights.lp";
    if (reference_lights)
        evaluation.lights = light_error(session, *reference_lights);
    else if (fs::exists(simulated_lights))
        evaluation.lights = light_error(session, simulated_lights);
    if (!evaluation.normals && !evaluation.lights)
        throw InputError("no truth is known of " + session.folder().string(),
                         "evaluate needs a simulated capture, an import with Normal_gt.mat, or --lights FILE");
    return evaluation;
}

}  // namespace darkbox
