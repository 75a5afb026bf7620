#include "processing/pipeline/lights_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

namespace darkbox {
namespace {

constexpr std::size_t most_values = 600'000;  // pixels times lights
constexpr std::size_t fewest_pixels = 100;
constexpr Eigen::Index fewest_lights = 5;  // four leave one number of each pixel unexplained: chance decides
constexpr int orders = 101;
constexpr double no_better = 0.6;             // of what a shuffled order adds to the least possible
constexpr double least_mean_residual = 0.05;  // below it no order is far off

std::vector<std::size_t> used_images(const Lights& lights) {
    std::vector<std::size_t> used;
    for (std::size_t i = 0; i < lights.size(); ++i)
        if (lights[i].used) used.push_back(i);
    return used;
}

std::vector<cv::Point> unclipped_pixels(const PhotoStack& stack, const std::vector<std::size_t>& used) {
    cv::Mat1b told = stack.mask.clone();
    for (const std::size_t image : used) told.setTo(0, stack.clipped[image]);
    const auto all = static_cast<std::size_t>(cv::countNonZero(told));
    const std::size_t most = std::max(fewest_pixels, most_values / used.size());
    const std::size_t stride = std::max<std::size_t>(1, (all + most - 1) / most);
    std::vector<cv::Point> pixels;
    std::size_t seen = 0;
    for (int y = 0; y < told.rows; ++y)
        for (int x = 0; x < told.cols; ++x)
            if (told(y, x) && seen++ % stride == 0) pixels.emplace_back(x, y);
    return pixels;
}

/// Products of the photographs with each other over these pixels, channel mean under lights of intensity 1.
Eigen::MatrixXd products(const PhotoStack& stack, const Lights& lights, const std::vector<std::size_t>& used,
                         const std::vector<cv::Point>& pixels) {
    Eigen::MatrixXd samples(static_cast<Eigen::Index>(used.size()), static_cast<Eigen::Index>(pixels.size()));
    for (std::size_t j = 0; j < used.size(); ++j)
        for (std::size_t p = 0; p < pixels.size(); ++p) {
            const cv::Vec3f& rgb = stack.images[used[j]](pixels[p]);
            const Eigen::Vector3d radiance(rgb[0], rgb[1], rgb[2]);
            samples(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(p)) =
                radiance.cwiseQuotient(lights[used[j]].intensity).mean();
        }
    return samples * samples.transpose();
}

/// The share of the samples' RMS that lies outside these three orthonormal columns.
double left_by(const Eigen::MatrixXd& products, const Eigen::MatrixXd& basis) {
    const double total = products.trace();
    const double inside = basis.cwiseProduct(products * basis).sum();
    return std::sqrt(std::max(0.0, total - inside) / total);
}

double median_of_orders(const Eigen::MatrixXd& products, const Eigen::MatrixXd& basis) {
    std::mt19937 bits(1);
    std::vector<Eigen::Index> order(static_cast<std::size_t>(basis.rows()));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::vector<double> left;
    for (int i = 0; i < orders; ++i) {
        for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[bits() % (k + 1)]);
        left.push_back(left_by(products, basis(order, Eigen::all)));
    }
    std::nth_element(left.begin(), left.begin() + orders / 2, left.end());
    return left[orders / 2];
}

}  // namespace

double LightsFit::excess() const {
    const double by_order = shuffled * shuffled - free * free;
    return by_order > 0 ? std::sqrt(std::max(0.0, given * given - free * free) / by_order) : 0;
}

std::optional<LightsFit> lights_fit(const PhotoStack& stack, const Lights& lights) {
    const std::vector<std::size_t> used = used_images(lights);
    if (std::any_of(used.begin(), used.end(), [&](std::size_t image) { return lights[image].near.has_value(); }))
        return std::nullopt;  // their directions change over the picture: no three images explain all pixels
    const auto directions = direction_matrix(lights);
    if (directions.rows() < fewest_lights) return std::nullopt;
    const std::vector<cv::Point> pixels = unclipped_pixels(stack, used);
    if (pixels.size() < fewest_pixels) return std::nullopt;
    const Eigen::MatrixXd all = products(stack, lights, used, pixels);
    if (!(all.trace() > 0) || !all.allFinite()) return std::nullopt;
    const Eigen::MatrixXd basis = Eigen::HouseholderQR<Eigen::MatrixXd>(directions).householderQ() *
                                  Eigen::MatrixXd::Identity(directions.rows(), 3);
    LightsFit fit;
    fit.given = left_by(all, basis);
    fit.shuffled = median_of_orders(all, basis);
    fit.free = left_by(all, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(all).eigenvectors().rightCols<3>());
    return fit;
}

std::optional<std::string> lights_warning(const PhotoStack& stack, const Lights& lights) {
    const auto fit = lights_fit(stack, lights);
    if (!fit || !(fit->given > least_mean_residual && fit->excess() > no_better)) return std::nullopt;
    return fmt::format(
        "the lights contradict the photographs: {:.0f} % of the radiance is left unexplained, about {:.0f} % would be "
        "with the same lights in any order, and {:.0f} % could be with the right ones: check that directions and "
        "intensities belong to these photographs, in this order",
        100 * fit->given, 100 * fit->shuffled, 100 * fit->free);
}

}  // namespace darkbox
