#include "processing/pipeline/held_out.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/normals/semi_calibrated.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/steps.h"
#include "processing/shading/shading.h"
#include "processing/texels/texels.h"

namespace darkbox {
namespace {

constexpr double shadow_share = 0.5;     // of what Lambert expects
constexpr double highlight_share = 0.2;  // of the albedo, above what Lambert expects
constexpr double hull_tolerance = 1e-6;  // of the plane's coordinates

double mean_of(const cv::Vec3f& v) { return (static_cast<double>(v[0]) + v[1] + v[2]) / 3; }

/// One pixel of a photograph as a light of intensity 1 would have made it, channel mean.
double normalised(const cv::Vec3f& radiance, const Light& light) {
    return (radiance[0] / light.intensity[0] + radiance[1] / light.intensity[1] + radiance[2] / light.intensity[2]) / 3;
}

PixelKind kind_of(double observed, double shading, double albedo) {
    const double expected = albedo * std::max(shading, 0.0);
    if (shading <= 0 || observed < shadow_share * expected) return PixelKind::shadowed;
    return observed > expected + highlight_share * albedo ? PixelKind::highlight : PixelKind::lit;
}

/// The kind of each pixel of one photograph, as an index into pixel_kinds; `all` (0) where nothing is compared.
cv::Mat1b kinds_of(const PhotoStack& stack, std::size_t image, const Light& light,
                   const PhotometricStereoResult& reference, const SceneGeometry& geometry) {
    const cv::Mat1d shading = lambert_shading(light, reference.normals, geometry);
    cv::Mat1b kinds(stack.size(), static_cast<uchar>(PixelKind::all));
    for (int y = 0; y < kinds.rows; ++y)
        for (int x = 0; x < kinds.cols; ++x) {
            if (reference.normals.valid(y, x) == 0) continue;
            const PixelKind kind = stack.clipped[image](y, x) != 0
                                       ? PixelKind::highlight
                                       : kind_of(normalised(stack.images[image](y, x), light), shading(y, x),
                                                 mean_of(reference.albedo.albedo(y, x)));
            kinds(y, x) = static_cast<uchar>(kind);
        }
    return kinds;
}

struct Sums {
    double squared = 0;
    std::size_t pixels = 0;
};

PredictionError error_from(const Sums& sums, double photograph_mean) {
    const double mse = sums.squared / static_cast<double>(3 * sums.pixels);
    return {std::sqrt(mse) / photograph_mean, -10 * std::log10(mse), sums.pixels};
}

double squared_error(const cv::Vec3f& predicted, const cv::Vec3f& observed, bool clipped) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double error = static_cast<double>(predicted[c]) - observed[c];
        if (!(clipped && error > 0)) sum += error * error;
    }
    return sum;
}

PredictionErrors compare(const cv::Mat3f& predicted, const cv::Mat3f& observed, const cv::Mat1b& clipped,
                         const cv::Mat1b& kinds) {
    std::array<Sums, pixel_kinds.size()> sums;
    double brightness = 0;
    for (int y = 0; y < kinds.rows; ++y)
        for (int x = 0; x < kinds.cols; ++x) {
            if (kinds(y, x) == static_cast<uchar>(PixelKind::all)) continue;
            const double squared = squared_error(predicted(y, x), observed(y, x), clipped(y, x) != 0);
            for (const std::size_t kind : {std::size_t{0}, std::size_t{kinds(y, x)}}) {
                sums[kind].squared += squared;
                ++sums[kind].pixels;
            }
            brightness += mean_of(observed(y, x));
        }
    PredictionErrors errors;
    const double mean = brightness / static_cast<double>(std::max<std::size_t>(sums[0].pixels, 1));
    for (std::size_t kind = 0; kind < sums.size(); ++kind)
        if (sums[kind].pixels > 0 && mean > 0) errors[kind] = error_from(sums[kind], mean);
    return errors;
}

/// The lights with that one left out, and its own brought to the scale of the others.
struct Fold {
    Lights others;
    Light held_out;
};

/// Both scales have a mean of 1 over their lights, which are not the same ones.
Light on_scale_of(const Lights& others, Light light, const Lights& before) {
    Eigen::Vector3d now = Eigen::Vector3d::Zero(), then = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < others.size(); ++i) {
        if (!others[i].used) continue;
        now += others[i].intensity;
        then += before[i].intensity;
    }
    light.intensity.array() *= now.array() / then.array();
    return light;
}

/// None where the other lights do not suffice.
std::optional<Fold> fold_without(std::size_t left_out, const PhotoStack& stack, const Lights& lights,
                                 HeldOutIntensities intensities, const WorkContext& work) {
    try {
        Fold fold{lights, lights[left_out]};
        fold.others[left_out].used = false;
        require_solvable(fold.others);
        if (intensities == HeldOutIntensities::estimated) {
            fold.others = estimate_intensities(stack, fold.others, {}, work).lights;
            fold.held_out = on_scale_of(fold.others, lights[left_out], lights);
        }
        return fold;
    } catch (const InputError&) {
        return std::nullopt;
    }
}

std::size_t count_used(const Lights& lights) {
    return static_cast<std::size_t>(std::count_if(lights.begin(), lights.end(), [](const Light& l) { return l.used; }));
}

double mean_change_deg(const NormalMap& a, const NormalMap& b) {
    if (cv::countNonZero(a.valid & b.valid) == 0) return 0;
    return angular_error(a, b).mean_deg;
}

/// What darkbox would relight, made from the used lights alone.
RelightScene scene_of(const PhotoStack& stack, const Lights& lights, const PhotometricStereoResult& solved,
                      const SceneGeometry& geometry, const WorkContext& work) {
    IndexMap index = cluster_texels(solved.albedo, {}, work).index;
    ShadingOptions options;
    options.geometry = geometry;
    ShadingResult shaded = shading_maps(stack, lights, solved.normals, solved.albedo, index, options, work);
    return {solved.normals, std::move(shaded.albedo), std::move(index), std::move(shaded.maps), geometry};
}

/// Coordinates in the plane across `axis`; no value for a direction that does not meet it.
std::optional<cv::Point2f> gnomonic(const Eigen::Vector3d& direction, const Eigen::Vector3d& axis) {
    const double along = direction.dot(axis);
    if (along < 1e-3) return std::nullopt;
    const Eigen::Vector3d right = axis.unitOrthogonal();
    const Eigen::Vector3d up = axis.cross(right);
    return cv::Point2f(static_cast<float>(direction.dot(right) / along), static_cast<float>(direction.dot(up) / along));
}

}  // namespace

const char* name(PixelKind kind) {
    switch (kind) {
        case PixelKind::all:
            return "all";
        case PixelKind::lit:
            return "lit";
        case PixelKind::shadowed:
            return "shadowed";
        case PixelKind::highlight:
            return "highlight";
    }
    return "";
}

MeanErrors mean_errors(const std::vector<HeldOutLight>& lights, std::size_t predictor, LightGroup group) {
    MeanErrors means;
    for (const HeldOutLight& light : lights) {
        const bool inside = group == LightGroup::every || light.hull == (group == LightGroup::hull);
        if (!inside || light.errors.empty()) continue;
        for (std::size_t kind = 0; kind < pixel_kinds.size(); ++kind) {
            const bool by_all =
                std::all_of(light.errors.begin(), light.errors.end(),
                            [kind](const PredictionErrors& errors) { return errors[kind].has_value(); });
            if (!by_all) continue;
            auto& mean = means.errors[kind];
            if (!mean) mean.emplace();
            const PredictionError& error = *light.errors[predictor][kind];
            mean->rmse_relative += error.rmse_relative;
            mean->psnr_db += error.psnr_db;
            mean->pixels += error.pixels;
            ++means.photographs[kind];
        }
    }
    for (std::size_t kind = 0; kind < pixel_kinds.size(); ++kind)
        if (auto& mean = means.errors[kind]) {
            mean->rmse_relative /= static_cast<double>(means.photographs[kind]);
            mean->psnr_db /= static_cast<double>(means.photographs[kind]);
        }
    return means;
}

std::vector<bool> on_hull(const Lights& lights) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Light& light : lights)
        if (light.used) sum += light.direction;
    const Eigen::Vector3d axis = sum.normalized();
    std::vector<cv::Point2f> points;
    for (const Light& light : lights)
        if (const auto point = gnomonic(light.direction, axis); light.used && point) points.push_back(*point);
    std::vector<cv::Point2f> hull;
    if (!points.empty()) cv::convexHull(points, hull);
    std::vector<bool> outside;
    for (const Light& light : lights) {
        const auto point = gnomonic(light.direction, axis);
        outside.push_back(light.used &&
                          (!point || hull.size() < 3 || cv::pointPolygonTest(hull, *point, true) < hull_tolerance));
    }
    return outside;
}

std::vector<HeldOutLight> leave_one_light_out(const PhotoStack& stack, const Lights& lights,
                                              const PhotometricStereoResult& reference,
                                              const std::vector<Predictor>& predictors,
                                              const PhotometricStereoOptions& options, HeldOutIntensities intensities,
                                              const WorkContext& work) {
    if (count_used(lights) < 4)
        throw InputError("with a light left out, fewer than three lights remain",
                         "leaving one out needs at least four lights");
    const PhotometricStereoResult whole = photometric_stereo(stack, lights, options, work);
    const std::vector<bool> hull = on_hull(lights);
    const WorkContext quietly{.report = {}, .stop = work.stop, .threads = work.threads};
    std::vector<HeldOutLight> results;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        step(work, {"leaving lights out", i, lights.size(), lights[i].file});
        HeldOutLight& result = results.emplace_back();
        result.file = lights[i].file;
        result.hull = hull[i];
        const auto fold = fold_without(i, stack, lights, intensities, quietly);
        if (!fold) continue;
        const PhotometricStereoResult solved = photometric_stereo(stack, fold->others, options, quietly);
        result.normal_change_deg = mean_change_deg(solved.normals, whole.normals);
        const cv::Mat1b kinds = kinds_of(stack, i, lights[i], reference, options.geometry);
        const RelightScene scene = scene_of(stack, fold->others, solved, options.geometry, quietly);
        for (const Predictor& predictor : predictors) {
            const auto predicted =
                predictor.predict({stack, fold->others, solved, scene, options.geometry}, fold->held_out, quietly);
            result.errors.push_back(predicted ? compare(*predicted, stack.images[i], stack.clipped[i], kinds)
                                              : PredictionErrors{});
        }
    }
    step(work, {"leaving lights out", lights.size(), lights.size(), ""});
    return results;
}

}  // namespace darkbox
