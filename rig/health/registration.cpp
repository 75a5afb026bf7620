#include "rig/health/registration.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace darkbox {
namespace {

constexpr double smoothing_px = 1.0;  ///< so that pixels between pixels can be told
constexpr int smallest_side = 24;     ///< of the coarsest picture
constexpr int most_levels = 5;
constexpr int border_px = 4;  ///< what smoothing, gradients and interpolation reach over
constexpr int most_turns = 40;
constexpr double settled_px = 1e-4;
constexpr int blocks_across = 8;
constexpr std::size_t fewest_blocks = 8;
constexpr int fewest_pixels = 200;
constexpr double best_alike = 0.5;  ///< correlation at the end: less is another scene

using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

struct Level {
    cv::Mat1f before, after;
    cv::Mat1b mask;
};

cv::Mat1f smooth(const cv::Mat1f& picture) {
    cv::Mat1f result;
    cv::GaussianBlur(picture, result, {}, smoothing_px);
    return result;
}

std::vector<Level> pyramid(const cv::Mat1f& before, const cv::Mat1f& after, const cv::Mat1b& mask) {
    std::vector<Level> levels{{smooth(before), smooth(after), mask}};
    while (static_cast<int>(levels.size()) < most_levels &&
           std::min(levels.back().before.rows, levels.back().before.cols) >= 2 * smallest_side) {
        const Level& fine = levels.back();
        Level coarse;
        cv::pyrDown(fine.before, coarse.before);
        cv::pyrDown(fine.after, coarse.after);
        cv::resize(fine.mask, coarse.mask, coarse.before.size(), 0, 0, cv::INTER_NEAREST);
        levels.push_back(std::move(coarse));
    }
    for (Level& level : levels) {
        cv::copyMakeBorder(level.mask, level.mask, border_px, border_px, border_px, border_px, cv::BORDER_CONSTANT,
                           cv::Scalar(0));
        cv::erode(level.mask, level.mask, cv::Mat(), {-1, -1}, border_px);
        level.mask = level.mask(cv::Rect(border_px, border_px, level.before.cols, level.before.rows)).clone();
    }
    return levels;
}

/// Keys' cubic, a = -1/2.
std::array<float, 4> taps(double fraction) {
    const auto cubic = [](double x) {
        x = std::abs(x);
        if (x < 1) return (1.5 * x - 2.5) * x * x + 1;
        return x < 2 ? ((-0.5 * x + 2.5) * x - 4) * x + 2 : 0;
    };
    std::array<float, 4> weights{};
    for (int i = 0; i < 4; ++i) weights.at(static_cast<std::size_t>(i)) = static_cast<float>(cubic(i - 1 - fraction));
    return weights;
}

/// The picture as it would be with what lies at x + by now at x. What comes from outside is the border's.
cv::Mat1f pulled(const cv::Mat1f& picture, cv::Point2d by) {
    const cv::Point whole(static_cast<int>(std::floor(by.x)), static_cast<int>(std::floor(by.y)));
    const auto across = taps(by.x - whole.x), down = taps(by.y - whole.y);
    cv::Mat1f between;
    cv::sepFilter2D(picture, between, CV_32F, cv::Mat(1, 4, CV_32F, const_cast<float*>(across.data())),
                    cv::Mat(4, 1, CV_32F, const_cast<float*>(down.data())), {1, 1}, 0, cv::BORDER_REPLICATE);
    const cv::Mat move = (cv::Mat_<double>(2, 3) << 1, 0, -whole.x, 0, 1, -whole.y);
    cv::Mat1f result;
    cv::warpAffine(between, result, move, picture.size(), cv::INTER_NEAREST, cv::BORDER_REPLICATE);
    return result;
}

/// Sums of the normal equations before = gain * after + offset - gain * gradient * step, for one block of the picture.
struct Block {
    Matrix4 squares = Matrix4::Zero();
    Vector4 products = Vector4::Zero();
    int pixels = 0;
};

struct Equations {
    std::vector<Block> blocks;
    Block all;
};

Equations equations(const Level& level, cv::Point2d shift) {
    const cv::Mat1f warped = pulled(level.after, shift);
    Equations result;
    result.blocks.resize(static_cast<std::size_t>(blocks_across) * blocks_across);
    const cv::Rect box = cv::boundingRect(level.mask);
    // What was pulled in over the border is not of the scene.
    const int left = border_px + static_cast<int>(std::ceil(std::max(0.0, -shift.x)));
    const int right = level.mask.cols - border_px - static_cast<int>(std::ceil(std::max(0.0, shift.x)));
    const int top = border_px + static_cast<int>(std::ceil(std::max(0.0, -shift.y)));
    const int bottom = level.mask.rows - border_px - static_cast<int>(std::ceil(std::max(0.0, shift.y)));
    for (int v = top; v < bottom; ++v)
        for (int u = left; u < right; ++u) {
            if (level.mask(v, u) == 0) continue;
            const Vector4 row(0.5 * (warped(v, u + 1) - warped(v, u - 1)), 0.5 * (warped(v + 1, u) - warped(v - 1, u)),
                              warped(v, u), 1);
            Block& block = result.blocks[static_cast<std::size_t>(
                (v - box.y) * blocks_across / box.height * blocks_across + (u - box.x) * blocks_across / box.width)];
            block.squares += row * row.transpose();
            block.products += row * level.before(v, u);
            ++block.pixels;
        }
    std::erase_if(result.blocks, [](const Block& block) { return block.pixels == 0; });
    for (const Block& block : result.blocks) {
        result.all.squares += block.squares;
        result.all.products += block.products;
        result.all.pixels += block.pixels;
    }
    return result;
}

/// How much further the shift is to go. None where the pictures do not tell.
std::optional<cv::Point2d> step_of(const Block& block) {
    const Eigen::FullPivLU<Matrix4> solver(block.squares);
    if (block.pixels < fewest_pixels || !solver.isInvertible()) return std::nullopt;
    const Vector4 found = solver.solve(block.products);
    if (!(found[2] > 0)) return std::nullopt;
    return cv::Point2d(found[0] / found[2], found[1] / found[2]);
}

std::optional<cv::Point2d> settle(const Level& level, cv::Point2d shift) {
    for (int turn = 0; turn < most_turns; ++turn) {
        const auto step = step_of(equations(level, shift).all);
        if (!step) return std::nullopt;
        const double length = cv::norm(*step);
        shift += length > 1 ? *step / length : *step;  // beyond a pixel the gradients tell the way, not how far
        if (std::max(std::abs(shift.x), std::abs(shift.y)) > 0.25 * std::min(level.mask.rows, level.mask.cols))
            return std::nullopt;
        if (length < settled_px) return shift;
    }
    return std::nullopt;
}

double alike(const Level& level, cv::Point2d shift) {
    const cv::Mat1f warped = pulled(level.after, shift);
    cv::Scalar mean_a, mean_b, sigma_a, sigma_b;
    cv::meanStdDev(level.before, mean_a, sigma_a, level.mask);
    cv::meanStdDev(warped, mean_b, sigma_b, level.mask);
    cv::Mat1f centred_a, centred_b;
    cv::subtract(level.before, mean_a, centred_a);
    cv::subtract(warped, mean_b, centred_b);
    const cv::Mat1f product(centred_a.mul(centred_b));
    return cv::mean(product, level.mask)[0] / std::max(sigma_a[0] * sigma_b[0], 1e-12);
}

/// Standard deviation of each of the two, by leaving out one block after the other.
std::optional<double> jackknife(const Equations& equations) {
    const auto count = equations.blocks.size();
    if (count < fewest_blocks) return std::nullopt;
    std::vector<cv::Point2d> without;
    for (const Block& block : equations.blocks) {
        Block rest = equations.all;
        rest.squares -= block.squares;
        rest.products -= block.products;
        rest.pixels -= block.pixels;
        const auto step = step_of(rest);
        if (!step) return std::nullopt;
        without.push_back(*step);
    }
    cv::Point2d mean;
    for (const cv::Point2d& step : without) mean += step / static_cast<double>(count);
    double squares = 0;
    for (const cv::Point2d& step : without) squares += (step - mean).dot(step - mean);
    return std::sqrt(squares / 2 * static_cast<double>(count - 1) / static_cast<double>(count));
}

}  // namespace

std::optional<Shift> measure_shift(const cv::Mat1f& before, const cv::Mat1f& after, const cv::Mat1b& mask) {
    const std::vector<Level> levels = pyramid(before, after, mask);
    cv::Point2d shift;
    for (std::size_t i = levels.size(); i-- > 0;) {
        shift *= 2;
        if (cv::countNonZero(levels[i].mask) < fewest_pixels && i > 0) continue;
        // A coarse picture in which nothing is left to tell by leaves it to the finer one.
        const auto settled = settle(levels[i], shift);
        if (settled)
            shift = *settled;
        else if (i == 0)
            return std::nullopt;
    }
    if (alike(levels.front(), shift) < best_alike) return std::nullopt;
    const auto sigma = jackknife(equations(levels.front(), shift));
    if (!sigma) return std::nullopt;
    return Shift{shift, *sigma};
}

}  // namespace darkbox
