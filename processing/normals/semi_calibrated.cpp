#include "processing/normals/semi_calibrated.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"

namespace darkbox {
namespace {

constexpr std::size_t fewest_samples = 4;     ///< of a pixel: three determine g, the rest say something of intensities
constexpr std::size_t most_values = 600'000;  ///< pixels times lights
constexpr double least_share_of_median = 1e-3;  ///< of a photograph that is not dark
constexpr double least_gap = 4;                 ///< of the second eigenvalue over the first
constexpr double least_second = 1e-6;           ///< of the second eigenvalue, relative to their mean
constexpr double largest_step = 20;             ///< an intensity's change in one round
constexpr double least_determinant = 1e-3;      ///< of the directions of a pixel's kept samples, per sample

/// One channel's samples, a column for each pixel; NaN where clipped or not a number.
using Samples = Eigen::MatrixXd;

/// Directions of the used lights, a row each; a near light's is shortened by its fall-off.
using Directions = Eigen::Matrix<double, Eigen::Dynamic, 3>;

struct UsedLights {
    std::vector<std::size_t> image;
    std::vector<Directions> directions;  ///< at each chosen pixel; one for all of them where all lights are distant

    const Directions& at(Eigen::Index pixel) const {
        return directions[directions.size() == 1 ? 0 : static_cast<std::size_t>(pixel)];
    }
};

Directions directions_at(const Lights& lights, const std::vector<std::size_t>& images, const Eigen::Vector3d& point) {
    Directions rows(static_cast<Eigen::Index>(images.size()), 3);
    for (std::size_t j = 0; j < images.size(); ++j) {
        const Incidence there = incidence(lights[images[j]], point);
        rows.row(static_cast<Eigen::Index>(j)) = there.falloff * there.direction.transpose();
    }
    return rows;
}

UsedLights used_of(const Lights& lights, const std::vector<cv::Point>& pixels, const SemiCalibratedOptions& options) {
    UsedLights used;
    bool near = false;
    for (std::size_t i = 0; i < lights.size(); ++i)
        if (lights[i].used) {
            used.image.push_back(i);
            near = near || lights[i].near;
        }
    if (!near) {
        used.directions.push_back(direction_matrix(lights));
        return used;
    }
    if (!options.geometry.view)
        throw InputError("the lights are near, but where the pixels lie is not known",
                         "give the view: millimetres per pixel at the object");
    for (const cv::Point& pixel : pixels)
        used.directions.push_back(
            directions_at(lights, used.image, options.geometry.point_at(pixel.y * options.row_step, pixel.x)));
    return used;
}

/// Every so many pixels of the mask, row by row.
std::vector<cv::Point> chosen_pixels(const cv::Mat1b& mask, std::size_t most) {
    const auto all = static_cast<std::size_t>(cv::countNonZero(mask));
    const std::size_t stride = std::max<std::size_t>(1, (all + most - 1) / most);
    std::vector<cv::Point> pixels;
    std::size_t seen = 0;
    for (int y = 0; y < mask.rows; ++y)
        for (int x = 0; x < mask.cols; ++x)
            if (mask(y, x) && seen++ % stride == 0) pixels.emplace_back(x, y);
    return pixels;
}

Samples samples_of(const PhotoStack& stack, const UsedLights& used, const std::vector<cv::Point>& pixels, int channel) {
    Samples samples(static_cast<Eigen::Index>(used.image.size()), static_cast<Eigen::Index>(pixels.size()));
    for (std::size_t j = 0; j < used.image.size(); ++j)
        for (std::size_t p = 0; p < pixels.size(); ++p) {
            const bool clipped = stack.clipped[used.image[j]](pixels[p]) != 0;
            samples(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(p)) =
                clipped ? std::nan("") : static_cast<double>(stack.images[used.image[j]](pixels[p])[channel]);
        }
    return samples;
}

double mean_of_finite(const Samples& samples, Eigen::Index light) {
    double sum = 0, count = 0;
    for (Eigen::Index p = 0; p < samples.cols(); ++p)
        if (std::isfinite(samples(light, p))) {
            sum += samples(light, p);
            count += 1;
        }
    return count > 0 ? sum / count : 0;
}

void require_light_in_all(const Samples& samples, const UsedLights& used, const Lights& lights) {
    std::vector<double> means;
    for (Eigen::Index j = 0; j < samples.rows(); ++j) means.push_back(mean_of_finite(samples, j));
    std::vector<double> sorted = means;
    std::sort(sorted.begin(), sorted.end());
    const double median = sorted[sorted.size() / 2];
    for (std::size_t j = 0; j < means.size(); ++j)
        if (!(means[j] > least_share_of_median * median))
            throw InputError(
                fmt::format("{} is dark, so its lamp's intensity cannot be estimated", lights[used.image[j]].file),
                "leave that frame out with --drop, or give intensities");
}

/// A pixel's samples that are neither among its darkest nor among its brightest, by their place among the lights.
std::vector<Eigen::Index> kept_samples(const Samples& even, Eigen::Index pixel, double trim) {
    std::vector<Eigen::Index> order;
    for (Eigen::Index j = 0; j < even.rows(); ++j)
        if (std::isfinite(even(j, pixel)) && even(j, pixel) > 0) order.push_back(j);
    if (order.size() < fewest_samples) return {};
    std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
        return std::pair(even(a, pixel), a) < std::pair(even(b, pixel), b);
    });
    const auto wanted = static_cast<std::size_t>(trim * static_cast<double>(order.size()));
    const auto cut = static_cast<std::ptrdiff_t>(std::min(wanted, (order.size() - fewest_samples) / 2));
    return {order.begin() + cut, order.end() - cut};
}

/// What all pixels leave unexplained, as a quadratic form of the factors by which the samples are multiplied.
struct Unexplained {
    Eigen::MatrixXd form;
    double squares = 0;  ///< sum of the kept samples' squares

    double relative_rms() const { return squares > 0 ? std::sqrt(std::max(0.0, form.sum()) / squares) : 0; }
};

/// diag(s) (1 - L (L^T L)^-1 L^T) diag(s), summed over pixels: a diagonal less the product of one wide matrix, three
/// columns for each pixel, with itself.
Unexplained unexplained(const Samples& even, const UsedLights& used, double trim) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(even.rows());
    Eigen::MatrixXd wide = Eigen::MatrixXd::Zero(even.rows(), 3 * even.cols());
    double squares = 0;
    for (Eigen::Index pixel = 0; pixel < even.cols(); ++pixel) {
        const std::vector<Eigen::Index> kept = kept_samples(even, pixel, trim);
        if (kept.empty()) continue;
        const Directions directions = used.at(pixel)(kept, Eigen::all);
        const Eigen::VectorXd samples = even(kept, pixel);
        const Eigen::Matrix3d moments = directions.transpose() * directions;
        const auto count = static_cast<double>(kept.size());
        if (moments.determinant() < least_determinant * count * count * count / 27) continue;
        // With moments = C C^T, the rows of directions C^-T are orthonormal columns.
        const Directions basis = moments.llt().matrixL().solve(directions.transpose()).transpose();
        for (std::size_t a = 0; a < kept.size(); ++a) {
            const auto row = static_cast<Eigen::Index>(a);
            diagonal[kept[a]] += samples[row] * samples[row];
            wide.block<1, 3>(kept[a], 3 * pixel) = samples[row] * basis.row(row);
        }
        squares += samples.squaredNorm();
    }
    Unexplained sum{diagonal.asDiagonal(), squares};
    sum.form.selfadjointView<Eigen::Lower>().rankUpdate(wide, -1);
    sum.form.triangularView<Eigen::StrictlyUpper>() = sum.form.transpose();
    return sum;
}

/// The smallest eigenvalues of a positive semidefinite form, and the vector of the first.
struct Smallest {
    double first = 0;
    double second = 0;
    Eigen::VectorXd vector;
};

/// Inverse iteration on a few vectors at a time, the first of them all ones, which is where factors end up. The whole
/// decomposition, of which this is the smallest part, takes minutes for a thousand lights.
Smallest smallest_of(const Eigen::MatrixXd& form) {
    constexpr Eigen::Index vectors = 8;
    constexpr int most_steps = 200;
    constexpr double exact = 1e-12;  // relative to the mean eigenvalue
    const Eigen::Index n = form.rows();
    const double mean = form.trace() / static_cast<double>(n);
    Eigen::MatrixXd shifted = form;
    shifted.diagonal().array() += 1e-9 * mean;  // what is singular can be solved then
    const Eigen::LLT<Eigen::MatrixXd> factored(shifted);
    Eigen::MatrixXd basis = Eigen::MatrixXd::Ones(n, std::min(vectors, n));
    for (Eigen::Index column = 1; column < basis.cols(); ++column)
        for (Eigen::Index row = 0; row < n; ++row)
            basis(row, column) = std::cos(static_cast<double>(column * row * row + column + row));
    Smallest found;
    for (int step = 0; step < most_steps; ++step) {
        const Eigen::MatrixXd solved = factored.solve(basis);
        basis =
            Eigen::HouseholderQR<Eigen::MatrixXd>(solved).householderQ() * Eigen::MatrixXd::Identity(n, basis.cols());
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> small(basis.transpose() * form * basis);
        basis = basis * small.eigenvectors();
        const Eigen::VectorXd& values = small.eigenvalues();
        const double change = std::max(std::abs(values[0] - found.first), std::abs(values[1] - found.second));
        const double off = (form * basis.col(0) - values[0] * basis.col(0)).norm();
        found = {values[0], values[1], basis.col(0)};
        if (step > 0 && change <= exact * mean && off <= exact * mean) break;
    }
    return found;
}

/// The factors that leave least; none where several sets of factors leave about the same.
std::optional<Eigen::VectorXd> best_factors(const Eigen::MatrixXd& form) {
    const Smallest smallest = smallest_of(form);
    const double mean = form.trace() / static_cast<double>(form.rows());
    if (!(smallest.second > least_gap * smallest.first && smallest.second > least_second * mean)) return std::nullopt;
    if (!(std::abs(smallest.vector.mean()) > 0)) return std::nullopt;
    return smallest.vector / smallest.vector.mean();
}

struct ChannelResult {
    Eigen::VectorXd intensity;
    double residual_equal = 0;
    double residual = 0;
    bool converged = false;
    bool open = false;  ///< the object does not tell intensities from shape
};

ChannelResult solve_channel(const Samples& samples, const UsedLights& used, const SemiCalibratedOptions& options,
                            const WorkContext& work) {
    ChannelResult result;
    result.intensity = Eigen::VectorXd::Ones(samples.rows());
    for (int round = 0; round <= options.most_rounds && !work.cancelled(); ++round) {
        const Samples even = result.intensity.cwiseInverse().asDiagonal() * samples;
        const Unexplained left = unexplained(even, used, options.trim);
        if (round == 0) result.residual_equal = left.relative_rms();
        result.residual = left.relative_rms();
        if (result.converged || round == options.most_rounds) break;
        const auto factors = best_factors(left.form);
        result.open = !factors;
        if (!factors) break;
        const Eigen::VectorXd step = factors->cwiseMax(1 / largest_step).cwiseMin(largest_step).cwiseInverse();
        const Eigen::VectorXd next = result.intensity.cwiseProduct(step);
        const Eigen::VectorXd scaled = next / next.mean();
        result.converged = (scaled.cwiseQuotient(result.intensity).array() - 1).abs().maxCoeff() < options.precision;
        result.intensity = scaled;
    }
    return result;
}

void require_matching(const PhotoStack& stack, const Lights& lights) {
    require_consistent(stack);
    if (stack.images.size() != lights.size())
        throw InputError(fmt::format("there are {} photographs but {} lights", stack.images.size(), lights.size()),
                         "give one light for each photograph, in the same order");
    require_solvable(lights);
    const auto used = direction_matrix(lights).rows();
    if (used < static_cast<Eigen::Index>(fewest_samples))
        throw InputError(fmt::format("intensities cannot be estimated from {} lights", used),
                         "use four lights or more, or a grey card");
}

}  // namespace

void SemiCalibratedOptions::validate() const {
    if (!(trim >= 0 && trim < 0.5)) throw InputError(fmt::format("trim is {}", trim), "allowed: 0 to below 0.5");
    if (most_pixels < 1) throw InputError(fmt::format("most_pixels is {}", most_pixels), "allowed: 1 or more");
    if (most_rounds < 1) throw InputError(fmt::format("most_rounds is {}", most_rounds), "allowed: 1 or more");
    if (!(precision > 0)) throw InputError(fmt::format("precision is {}", precision), "allowed: above 0");
    if (row_step < 1) throw InputError(fmt::format("row_step is {}", row_step), "allowed: 1 or more");
}

SemiCalibratedResult estimate_intensities(const PhotoStack& stack, const Lights& lights,
                                          const SemiCalibratedOptions& options, const WorkContext& work) {
    options.validate();
    require_matching(stack, lights);
    const auto count = static_cast<std::size_t>(direction_matrix(lights).rows());
    const std::size_t most =
        std::clamp<std::size_t>(most_values / count, 100, static_cast<std::size_t>(options.most_pixels));
    const std::vector<cv::Point> pixels = chosen_pixels(stack.mask, most);
    const UsedLights used = used_of(lights, pixels, options);
    std::array<Samples, 3> samples;
    for (int channel = 0; channel < 3; ++channel) {
        samples[static_cast<std::size_t>(channel)] = samples_of(stack, used, pixels, channel);
        require_light_in_all(samples[static_cast<std::size_t>(channel)], used, lights);
    }
    std::array<ChannelResult, 3> channels;  // independent of each other: one thread each
    on_threads_of(work, [&] {
        tbb::parallel_for(std::size_t{0}, std::size_t{3},
                          [&](std::size_t c) { channels[c] = solve_channel(samples[c], used, options, work); });
    });
    if (work.cancelled()) throw Cancelled("estimating intensities was stopped", "run the same command again");

    SemiCalibratedResult result{lights, 0, 0, true};
    for (std::size_t c = 0; c < 3; ++c) {
        if (channels[c].open)
            throw InputError("this object does not tell the lamps' intensities from its own shape",
                             "take them from a grey card (calibrate --grey-card), or use --intensities given");
        for (std::size_t j = 0; j < used.image.size(); ++j)
            result.lights[used.image[j]].intensity[static_cast<Eigen::Index>(c)] =
                channels[c].intensity[static_cast<Eigen::Index>(j)];
        result.residual_equal += channels[c].residual_equal / 3;
        result.residual += channels[c].residual / 3;
        result.converged = result.converged && channels[c].converged;
    }
    return result;
}

}  // namespace darkbox
