#include "processing/normals/integrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/normals/bilateral.h"
#include "processing/normals/difference_solver.h"
#include "processing/normals/slopes.h"

namespace darkbox {
namespace {

using Heights = std::vector<double>;

constexpr int coarsest_side = 48;          // pixels; from there on the solution is carried to twice the size
constexpr double noise_is_no_break = 4.0;  // standard deviations of the misfits
/// How far one re-weighting is solved before the next goes on from there, and how far the last.
constexpr double solve_tolerance = 0.1, last_tolerance = 1e-3;
constexpr int solve_iterations = 12, last_iterations = 10;
constexpr int last_passes = 2;  // the second removes what single precision left

struct Integration {
    explicit Integration(const PixelGrid& grid) : heights(grid.size(), 0.0), shares(grid), edges(grid) {}
    Heights heights;
    Shares shares;
    BilateralEdges edges;
    int iterations = 0;
};

/// Moves the heights by the difference equations' solution under the present weights.
void relax(const Slopes& slopes, double tolerance, int most_iterations, Integration& state) {
    const PixelGrid& grid = slopes.grid;
    const BilateralEdges& edges = state.edges;
    std::vector<float> residual(grid.size(), 0.0F);
    for_blocks(grid.begin(), grid.end(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            residual[i] =
                edges.pull_right[i - 1] - edges.pull_right[i] + edges.pull_down[i - grid.stride()] - edges.pull_down[i];
    });
    const std::vector<float> step =
        DifferenceSolver(grid, edges.weights).solve(std::move(residual), tolerance, most_iterations);
    for_blocks(0, grid.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) state.heights[i] += static_cast<double>(step[i]);
    });
}

/// Twice the heights of the half-size solution, and inside each of its pixels the slope.
Heights guess_from(const Heights& coarse, const PixelGrid& half, const Slopes& slopes) {
    Heights heights(slopes.grid.size(), 0.0);
    for (int y = 0; y < slopes.grid.height; ++y)
        for (int x = 0; x < slopes.grid.width; ++x) {
            const std::size_t i = slopes.grid.at(x, y);
            if (!slopes.valid(i)) continue;
            heights[i] = 2 * coarse[half.at(x / 2, y / 2)] + (x % 2 - 0.5) * static_cast<double>(slopes.right[i]) +
                         (y % 2 - 0.5) * static_cast<double>(slopes.down[i]);
        }
    return heights;
}

void require_running(const WorkContext& work) {
    if (work.cancelled()) throw Cancelled("the integration of height was cancelled", "run it again to get heights");
}

Integration integrate(const Slopes& slopes, const IntegrationOptions& options, const WorkContext& work) {
    Integration state(slopes.grid);
    if (std::max(slopes.grid.width, slopes.grid.height) > coarsest_side) {
        const Slopes half = halved(slopes);
        state.heights = guess_from(integrate(half, options, work).heights, half.grid, slopes);
    }
    double sharpness = 0, energy = 0;
    if (options.method == IntegrationMethod::bilateral) {
        if (std::max(slopes.grid.width, slopes.grid.height) <= coarsest_side) {
            update_edges(slopes, state.shares, state.heights, 0, state.edges);
            relax(slopes, last_tolerance, last_iterations, state);
        }
        sharpness = std::pow(std::max(options.breaks_at, noise_is_no_break * misfit_scale(slopes, state.heights)), -2);
        for (int iteration = 0; iteration < options.most_iterations; ++iteration) {
            require_running(work);
            update_shares(slopes, state.heights, sharpness, state.shares);
            update_edges(slopes, state.shares, state.heights, sharpness, state.edges);
            ++state.iterations;
            if (iteration > 0 && std::abs(energy - state.edges.energy) <= options.tolerance * energy) break;
            energy = state.edges.energy;
            relax(slopes, solve_tolerance, solve_iterations, state);
        }
    }
    for (int pass = 0; pass < last_passes; ++pass) {
        require_running(work);
        update_edges(slopes, state.shares, state.heights, sharpness, state.edges);
        relax(slopes, last_tolerance, last_iterations, state);
    }
    return state;
}

/// Numbers 1... of the connected parts; 0 outside.
cv::Mat1i parts_of(const cv::Mat1b& valid) {
    cv::Mat1i part;
    cv::connectedComponents(valid, part, 4, CV_32S);
    return part;
}

/// Per part the mean of value(x, y).
template <class Value>
std::vector<double> means_of(const cv::Mat1i& part, int parts, Value&& value) {
    std::vector<double> sum(static_cast<std::size_t>(parts) + 1, 0.0), count(sum.size(), 0.0);
    for (int y = 0; y < part.rows; ++y)
        for (int x = 0; x < part.cols; ++x)
            if (part(y, x) > 0) {
                sum[static_cast<std::size_t>(part(y, x))] += value(x, y);
                ++count[static_cast<std::size_t>(part(y, x))];
            }
    for (std::size_t p = 1; p < sum.size(); ++p) sum[p] /= std::max(count[p], 1.0);
    return sum;
}

/// Heights in pixels along each ray's own scale become z in the viewer frame, its mean 0 over each part.
class Gauge {
public:
    explicit Gauge(const std::optional<ViewGeometry>& view) : view_(view) {}

    /// What is averaged over a part: the height itself, or under perspective the depth up to a factor.
    double averaged(double height) const { return perspective() ? std::exp(-height / focal_px()) : height; }
    double z(double height, double mean) const {
        if (perspective()) return view_->distance_mm * (1 - averaged(height) / mean);
        return (height - mean) * (view_ ? view_->mm_per_pixel : 1.0);
    }

private:
    bool perspective() const { return view_ && view_->perspective(); }
    double focal_px() const { return view_->distance_mm / view_->mm_per_pixel; }
    const std::optional<ViewGeometry>& view_;
};

HeightMap map_of(const IntegrationInput& input, const cv::Rect& box, const Slopes& slopes, const Integration& found,
                 const IntegrationOptions& options) {
    HeightMap map;
    map.valid = cv::Mat1b(input.normals.valid.size(), uchar{0});
    map.cut = map.valid.clone();
    map.height = cv::Mat1f(map.valid.size(), 0.0F);
    map.unit = input.view ? HeightUnit::millimetres : HeightUnit::pixels;
    map.iterations = found.iterations;
    const std::vector<unsigned char> cuts = cuts_of(slopes, found.edges, options.cut_below);
    for (int y = 0; y < box.height; ++y)
        for (int x = 0; x < box.width; ++x) {
            map.valid(box.y + y, box.x + x) = slopes.valid(slopes.grid.at(x, y)) ? 255 : 0;
            map.cut(box.y + y, box.x + x) = cuts[slopes.grid.at(x, y)];
        }
    const cv::Mat1i part = parts_of(map.valid);
    double most = 0;
    cv::minMaxLoc(part, nullptr, &most);
    map.parts = static_cast<int>(most);
    const Gauge gauge(input.view);
    const auto height = [&](int x, int y) { return found.heights[slopes.grid.at(x - box.x, y - box.y)]; };
    const std::vector<double> offset = means_of(part, map.parts, height);
    const std::vector<double> mean = means_of(part, map.parts, [&](int x, int y) {
        return gauge.averaged(height(x, y) - offset[static_cast<std::size_t>(part(y, x))]);
    });
    for (int y = 0; y < part.rows; ++y)
        for (int x = 0; x < part.cols; ++x) {
            const auto p = static_cast<std::size_t>(part(y, x));
            if (p > 0) map.height(y, x) = static_cast<float>(gauge.z(height(x, y) - offset[p], mean[p]));
        }
    return map;
}

void require_usable(const IntegrationInput& input) {
    if (input.normals.valid.empty() || cv::countNonZero(input.normals.valid) == 0)
        throw InputError("the normal map has no valid pixel to integrate", "check the mask");
    require_size("the normal map", input.normals.normal.size(), input.normals.valid.size());
    if (input.confidence.empty()) return;
    require_size("the confidence map", input.confidence.size(), input.normals.valid.size());
    for (int y = 0; y < input.confidence.rows; ++y)
        for (int x = 0; x < input.confidence.cols; ++x)
            if (const float c = input.confidence(y, x); input.normals.valid(y, x) && !(c > 0 && std::isfinite(c)))
                throw InputError(fmt::format("the confidence at ({}, {}) is {}", x, y, c),
                                 "give a positive number wherever the normal is valid");
}

}  // namespace

void IntegrationOptions::validate() const {
    const auto require = [](bool holds, const char* field, double value, const char* allowed) {
        if (!holds) throw InputError(fmt::format("{} is {}", field, value), fmt::format("allowed: {}", allowed));
    };
    require(breaks_at > 0 && breaks_at <= 100, "breaks_at", breaks_at, "above 0, to 100 (pixels per pixel)");
    require(most_iterations >= 1 && most_iterations <= 10'000, "most_iterations", most_iterations, "1 to 10000");
    require(tolerance > 0 && tolerance < 1, "tolerance", tolerance, "between 0 and 1");
    require(cut_below > 0 && cut_below < 1, "cut_below", cut_below, "between 0 and 1");
}

HeightMap integrate_normals(const IntegrationInput& input, const IntegrationOptions& options, const WorkContext& work) {
    options.validate();
    require_usable(input);
    const auto start = std::chrono::steady_clock::now();
    const cv::Rect box = cv::boundingRect(input.normals.valid);
    const Slopes slopes = slopes_of(input, box);
    const Integration found = on_threads_of(work, [&] { return integrate(slopes, options, work); });
    HeightMap map = map_of(input, box, slopes, found, options);
    map.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return map;
}

}  // namespace darkbox
