#include "processing/pipeline/predictors.h"

#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/relight/ptm.h"

namespace darkbox {
namespace {

cv::Mat3f lambert(const HeldOutTraining& training, const Light& light) {
    const PhotometricStereoResult& solved = training.solved;
    const cv::Mat1d shading = lambert_shading(light, solved.normals, training.geometry);
    cv::Mat3f image(training.stack.size(), cv::Vec3f::all(0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            if (solved.normals.valid(y, x) == 0) continue;
            const cv::Vec3f& albedo = solved.albedo.albedo(y, x);
            for (int c = 0; c < 3; ++c)
                image(y, x)[c] = static_cast<float>(albedo[c] * std::max(0.0, shading(y, x)) * light.intensity[c]);
        }
    return image;
}

std::optional<cv::Mat3f> polynomial(const HeldOutTraining& training, const Light& light, const WorkContext& work) {
    try {
        cv::Mat3f image = evaluate(fit_ptm(training.stack, training.lights, PtmModel::rgb, work), light.direction);
        for (cv::Vec3f& radiance : image)
            for (int c = 0; c < 3; ++c)
                radiance[c] = static_cast<float>(std::max(0.0, radiance[c] * light.intensity[c]));
        return image;
    } catch (const InputError&) {  // too few lights, or not told apart: PTM has no answer, the others do
        return std::nullopt;
    }
}

}  // namespace

cv::Mat1d lambert_shading(const Light& light, const NormalMap& normals, const SceneGeometry& geometry) {
    cv::Mat1d shading(normals.normal.size(), 0.0);
    for (int y = 0; y < shading.rows; ++y)
        for (int x = 0; x < shading.cols; ++x) {
            if (normals.valid(y, x) == 0) continue;
            const cv::Vec3f& n = normals.normal(y, x);
            const Incidence at = light.near ? incidence(light, geometry.point_at(y, x)) : Incidence{light.direction, 1};
            shading(y, x) = at.direction.dot(Eigen::Vector3d(n[0], n[1], n[2])) * at.falloff;
        }
    return shading;
}

Predictor lambert_predictor() {
    return {"lambert", [](const HeldOutTraining& training, const Light& light, const WorkContext&) {
                return std::optional(lambert(training, light));
            }};
}

Predictor darkbox_predictor(Lookup lookup) {
    RelightOptions options;
    options.lookup = lookup;
    return {lookup == Lookup::thesis ? "darkbox_thesis" : "darkbox_detail",
            [options](const HeldOutTraining& training, const Light& light, const WorkContext& work) {
                Light shining = light;
                shining.used = true;
                return std::optional(relight(training.scene, {shining}, options, work).image);
            }};
}

Predictor ptm_predictor() { return {"ptm", polynomial}; }

std::vector<Predictor> every_predictor() {
    return {darkbox_predictor(Lookup::thesis), darkbox_predictor(Lookup::detail), lambert_predictor(), ptm_predictor()};
}

}  // namespace darkbox
