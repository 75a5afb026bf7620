#include "processing/normals/least_squares.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace darkbox {
namespace {

/// Leaving clipped samples out may make the lights' geometry this much worse conditioned; beyond it, noise would hurt
/// more than clipping does.
constexpr double max_condition_growth = 4.0;

/// The columns [begin, end) that hold all of a row's mask.
struct Span {
    int begin = 0;
    int end = 0;
    int size() const { return end - begin; }
};

Span masked_span(const cv::Mat1b& mask, int row) {
    const uchar* m = mask[row];
    Span span{0, mask.cols};
    while (span.begin < span.end && m[span.begin] == 0) ++span.begin;
    while (span.end > span.begin && m[span.end - 1] == 0) --span.end;
    return span;
}

/// One row of the solution as planes, so that the loops over columns vectorise.
struct Planes {
    explicit Planes(Span columns)
        : span(columns),
          g(static_cast<std::size_t>(3 * span.size())),
          colour(static_cast<std::size_t>(3 * span.size())),
          lit_weight(static_cast<std::size_t>(span.size())),
          squared(static_cast<std::size_t>(span.size())),
          clipped(static_cast<std::size_t>(span.size())),
          excluded(static_cast<std::size_t>(span.size())) {}

    float* gx() { return g.data(); }
    float* gy() { return g.data() + span.size(); }
    float* gz() { return g.data() + 2 * span.size(); }
    Eigen::Vector3f g_at(int i) { return {gx()[i], gy()[i], gz()[i]}; }

    Span span;
    std::vector<float> g;           ///< albedo times normal: x, y, z planes
    std::vector<float> colour;      ///< sum of I_c (g.L)+, interleaved
    std::vector<float> lit_weight;  ///< sum of (g.L)+^2
    std::vector<float> squared;     ///< sum of squared residuals
    std::vector<int> clipped;       ///< clipped samples of each pixel
    std::vector<uchar> excluded;    ///< 1: this pixel's clipped samples are left out
};

const float* pixels(const PhotoStack& stack, const SolverLight& light, int row, Span span) {
    return stack.images[light.image].ptr<float>(row) + std::ptrdiff_t{3} * span.begin;
}

const uchar* clipping(const PhotoStack& stack, const SolverLight& light, int row, Span span) {
    return stack.clipped[light.image][row] + span.begin;
}

float channel_mean(const float* rgb, const SolverLight& light) {
    return (rgb[0] * light.gain[0] + rgb[1] * light.gain[1] + rgb[2] * light.gain[2]) / 3.0F;
}

/// g over all lights through the shared pseudo-inverse, and the count of clipped samples.
void accumulate_all_lights(const PhotoStack& stack, const LightSet& set, int row, Planes& planes) {
    const int n = planes.span.size();
    float *gx = planes.gx(), *gy = planes.gy(), *gz = planes.gz();
    for (const SolverLight& light : set.lights) {
        const float* rgb = pixels(stack, light, row, planes.span);
        const uchar* clipped = clipping(stack, light, row, planes.span);
        const Eigen::Vector3f p = light.pseudo_column;
        for (int i = 0; i < n; ++i) {
            const float mean = channel_mean(rgb + std::ptrdiff_t{3} * i, light);
            gx[i] += p.x() * mean;
            gy[i] += p.y() * mean;
            gz[i] += p.z() * mean;
            planes.clipped[static_cast<std::size_t>(i)] += clipped[i] != 0;
        }
    }
}

/// g of one pixel from its unclipped samples; no value where these do not determine it well.
std::optional<Eigen::Vector3f> solve_unclipped(const PhotoStack& stack, const LightSet& set, int row, int column) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    Eigen::Vector3d projected = Eigen::Vector3d::Zero();
    int samples = 0;
    for (const SolverLight& light : set.lights) {
        if (stack.clipped[light.image](row, column) != 0) continue;
        const Eigen::Vector3d direction = light.direction.cast<double>();
        const float mean = channel_mean(stack.images[light.image].ptr<float>(row, column), light);
        moments += direction * direction.transpose();
        projected += direction * static_cast<double>(mean);
        ++samples;
    }
    if (samples < 3) return std::nullopt;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(moments, Eigen::EigenvaluesOnly);
    const double limit = max_condition_growth * set.condition_number;
    if (!(eigen.eigenvalues()[2] <= limit * limit * eigen.eigenvalues()[0])) return std::nullopt;
    return (moments.inverse() * projected).cast<float>();
}

void leave_out_clipped(const PhotoStack& stack, const LightSet& set, int row, Planes& planes) {
    for (int i = 0; i < planes.span.size(); ++i) {
        if (planes.clipped[static_cast<std::size_t>(i)] == 0) continue;
        if (const auto g = solve_unclipped(stack, set, row, planes.span.begin + i)) {
            planes.gx()[i] = g->x();
            planes.gy()[i] = g->y();
            planes.gz()[i] = g->z();
            planes.excluded[static_cast<std::size_t>(i)] = 1;
        }
    }
}

/// The sums behind albedo and residual. They use g where N is meant: the scale |g| cancels in finish_pixel().
void accumulate_albedo(const PhotoStack& stack, const LightSet& set, int row, Planes& planes) {
    const int n = planes.span.size();
    const float *gx = planes.gx(), *gy = planes.gy(), *gz = planes.gz();
    float *colour = planes.colour.data(), *lit_weight = planes.lit_weight.data(), *squared = planes.squared.data();
    const uchar* excluded = planes.excluded.data();
    for (const SolverLight& light : set.lights) {
        const float* rgb = pixels(stack, light, row, planes.span);
        const uchar* clipped = clipping(stack, light, row, planes.span);
        const Eigen::Vector3f l = light.direction;
        for (int i = 0; i < n; ++i) {
            const float kept = (excluded[i] != 0 && clipped[i] != 0) ? 0.0F : 1.0F;
            const float shading = gx[i] * l.x() + gy[i] * l.y() + gz[i] * l.z();
            const float lit = kept * std::max(shading, 0.0F);
            const float error = kept * (channel_mean(rgb + std::ptrdiff_t{3} * i, light) - shading);
            for (std::ptrdiff_t c = 0; c < 3; ++c)
                colour[3 * i + c] += rgb[3 * i + c] * light.gain[static_cast<std::size_t>(c)] * lit;
            lit_weight[i] += lit * lit;
            squared[i] += error * error;
        }
    }
}

/// Writes one pixel; true when it is valid.
bool finish_pixel(Planes& planes, int i, int samples, float min_albedo, int row, SolvedMaps& maps) {
    const Eigen::Vector3f g = planes.g_at(i);
    const float length = g.norm();
    const auto at = static_cast<std::size_t>(i);
    if (!(length > 0) || !(planes.lit_weight[at] > 0)) return false;
    const float scale = length / planes.lit_weight[at];
    const cv::Vec3f albedo(planes.colour[3 * at] * scale, planes.colour[3 * at + 1] * scale,
                           planes.colour[3 * at + 2] * scale);
    if (!((albedo[0] + albedo[1] + albedo[2]) / 3.0F >= min_albedo)) return false;

    const int column = planes.span.begin + i;
    maps.normal(row, column) = cv::Vec3f(g.x() / length, g.y() / length, g.z() / length);
    maps.albedo(row, column) = albedo;
    maps.valid(row, column) = 255;
    maps.residual(row, column) = std::sqrt(planes.squared[at] / static_cast<float>(samples));
    maps.lights_used(row, column) = static_cast<uchar>(std::min(samples, 255));
    return true;
}

}  // namespace

SolvedMaps::SolvedMaps(cv::Size size)
    : normal(size, cv::Vec3f::all(0)),
      albedo(size, cv::Vec3f::all(0)),
      valid(size, uchar{0}),
      residual(size, 0.0F),
      lights_used(size, uchar{0}) {}

RowSums solve_row_least_squares(const PhotoStack& stack, const LightSet& set, float min_albedo, int row,
                                SolvedMaps& maps) {
    RowSums sums;
    Planes planes(masked_span(stack.mask, row));
    accumulate_all_lights(stack, set, row, planes);

    // A sample that is not finite leaves its trace in g; it is looked for before clipped samples are dropped, so that
    // such a pixel is never half used.
    std::vector<uchar> usable(static_cast<std::size_t>(planes.span.size()));
    for (int i = 0; i < planes.span.size(); ++i) {
        if (stack.mask(row, planes.span.begin + i) == 0) continue;
        const bool finite = planes.g_at(i).allFinite();
        usable[static_cast<std::size_t>(i)] = finite;
        sums.not_finite += !finite;
    }
    leave_out_clipped(stack, set, row, planes);
    accumulate_albedo(stack, set, row, planes);

    const int lights = static_cast<int>(set.lights.size());
    for (int i = 0; i < planes.span.size(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        const int samples = planes.excluded[at] ? lights - planes.clipped[at] : lights;
        if (!usable[at] || !finish_pixel(planes, i, samples, min_albedo, row, maps)) continue;
        sums.squared_residual += static_cast<double>(planes.squared[at]);
        sums.samples += static_cast<std::size_t>(samples);
        ++sums.pixels;
    }
    return sums;
}

}  // namespace darkbox
