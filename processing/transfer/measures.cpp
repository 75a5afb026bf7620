#include "processing/transfer/measures.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"
#include "processing/transfer/expected_look.h"
#include "processing/transfer/option_checks.h"
#include "processing/transfer/patch_energy.h"

namespace darkbox {
namespace {

void require_appearance(const char* whose, const NormalMap& normals, cv::Size picture) {
    require_size(fmt::format("the {}'s mask", whose).c_str(), normals.valid.size(), normals.normal.size());
    require_size(fmt::format("the {}'s picture", whose).c_str(), picture, normals.normal.size());
    if (cv::countNonZero(normals.valid) == 0)
        throw InputError(fmt::format("the {} has no valid pixel", whose),
                         "check its mask: it must be white on the object");
}

void require_coordinates(const cv::Mat2i& coordinates, const cv::Mat1b& target, cv::Size source) {
    require_size("the map of source coordinates", coordinates.size(), target.size());
    for (int y = 0; y < target.rows; ++y)
        for (int x = 0; x < target.cols; ++x) {
            const cv::Point p(coordinates(y, x));
            if (!target(y, x) || cv::Rect(cv::Point(0, 0), source).contains(p)) continue;
            throw InputError(fmt::format("the source coordinate at ({}, {}) is ({}, {}), but the source is {} x {}", x,
                                         y, p.x, p.y, source.width, source.height),
                             "the coordinates must belong to this source and cover the whole target");
        }
}

cv::Mat3b read_through(const cv::Mat3b& source, const cv::Mat2i& coordinates, const cv::Mat1b& valid) {
    cv::Mat3b picture(valid.size(), cv::Vec3b(0, 0, 0));
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) picture(y, x) = source(cv::Point(coordinates(y, x)));
    return picture;
}

/// The target's pixels whose normals the source has.
cv::Mat1b known_pixels(const ExpectedLook& look, const NormalMap& target) {
    cv::Mat1b known = target.valid.clone();
    for (int y = 0; y < known.rows; ++y)
        for (int x = 0; x < known.cols; ++x)
            if (known(y, x) && !look.knows(target.normal(y, x))) known(y, x) = 0;
    return known;
}

/// The mean of the valid pixels under a Gaussian; zero outside.
cv::Mat3f blurred_within(const cv::Mat3f& picture, const cv::Mat1b& valid, double sigma) {
    cv::Mat3f colour(picture.size(), cv::Vec3f(0, 0, 0));
    cv::Mat1f weight;
    picture.copyTo(colour, valid);
    valid.convertTo(weight, CV_32F, 1 / 255.0);
    cv::GaussianBlur(colour, colour, cv::Size(), sigma, sigma);
    cv::GaussianBlur(weight, weight, cv::Size(), sigma, sigma);
    for (int y = 0; y < picture.rows; ++y)
        for (int x = 0; x < picture.cols; ++x)
            colour(y, x) = valid(y, x) ? colour(y, x) * (1 / weight(y, x)) : cv::Vec3f(0, 0, 0);
    return colour;
}

std::optional<double> colour_error(const ExpectedLook& look, const Appearance& target, const cv::Mat1b& known,
                                   double sigma) {
    const int pixels = cv::countNonZero(known);
    if (pixels == 0) return std::nullopt;
    cv::Mat3f expected(known.size(), cv::Vec3f(0, 0, 0));
    for (int y = 0; y < known.rows; ++y)
        for (int x = 0; x < known.cols; ++x)
            if (known(y, x)) expected(y, x) = look.colour(target.normals.normal(y, x));
    cv::Mat3f shown;
    target.picture.convertTo(shown, CV_32F);
    cv::Mat3f difference;
    cv::subtract(blurred_within(shown, known, sigma), blurred_within(expected, known, sigma), difference);
    double sum = 0;
    for (int y = 0; y < known.rows; ++y)
        for (int x = 0; x < known.cols; ++x)
            if (known(y, x)) sum += std::sqrt(difference(y, x).dot(difference(y, x)) / 3.0);
    return sum / pixels;
}

std::optional<double> sharpness(const ExpectedLook& look, const Appearance& target, const cv::Mat1b& known) {
    const cv::Mat1f laplacian = squared_laplacian(target.picture);
    const cv::Mat1b inner = inner_pixels(known, 1);
    double shown = 0;
    double expected = 0;
    for (int y = 0; y < inner.rows; ++y)
        for (int x = 0; x < inner.cols; ++x) {
            if (!inner(y, x)) continue;
            shown += static_cast<double>(laplacian(y, x));
            expected += static_cast<double>(look.sharpness(target.normals.normal(y, x)));
        }
    if (!(expected > 0)) return std::nullopt;
    return shown / expected;
}

/// Shares of the 256 values of L, a and b; each pixel counts as often as `weight` says.
using LabHistogram = std::array<std::array<double, 256>, 3>;

template <class Weight>
LabHistogram lab_histogram(const cv::Mat3b& picture, const Weight& weight) {
    cv::Mat3b lab;
    cv::cvtColor(picture, lab, cv::COLOR_RGB2Lab);
    LabHistogram histogram{};
    double sum = 0;
    for (int y = 0; y < lab.rows; ++y)
        for (int x = 0; x < lab.cols; ++x) {
            const double w = weight(y, x);
            for (int c = 0; c < 3; ++c) histogram[c][lab(y, x)[c]] += w;
            sum += w;
        }
    for (auto& channel : histogram)
        for (double& share : channel) share /= sum;
    return histogram;
}

double earth_movers_distance(const LabHistogram& a, const LabHistogram& b) {
    double distance = 0;
    for (std::size_t c = 0; c < a.size(); ++c) {
        double difference = 0;
        for (std::size_t value = 0; value < a[c].size(); ++value) {
            difference += a[c][value] - b[c][value];
            distance += std::abs(difference) / static_cast<double>(a.size());
        }
    }
    return distance;
}

std::optional<double> histogram_distance(const ExpectedLook& look, const Appearance& source, const Appearance& target,
                                         const cv::Mat1b& known) {
    if (cv::countNonZero(known) == 0) return std::nullopt;
    const cv::Mat1f use = look.expected_use(source, {target.normals.normal, known});
    return earth_movers_distance(
        lab_histogram(source.picture, [&](int y, int x) { return static_cast<double>(use(y, x)); }),
        lab_histogram(target.picture, [&](int y, int x) { return known(y, x) ? 1.0 : 0.0; }));
}

TransferMeasures measured(const Appearance& source, const Appearance& target, const MeasureOptions& options) {
    const ExpectedLook look(source);
    const cv::Mat1b known = known_pixels(look, target.normals);
    TransferMeasures m;
    m.joint_energy = patch_energy(joint_patches(source, options.window), joint_patches(target, options.window),
                                  options.window, options.stride);
    m.patch_energy = patch_energy(colour_patches(source, options.window), colour_patches(target, options.window),
                                  options.window, options.stride);
    m.colour_error = colour_error(look, target, known, options.low_pass);
    m.histogram_distance = histogram_distance(look, source, target, known);
    m.sharpness = sharpness(look, target, known);
    return m;
}

}  // namespace

void MeasureOptions::validate() const {
    const OptionChecks checks{"measures"};
    checks.require_range("window", window, 3, 15);
    checks.require_odd("window", window);
    checks.require_range("stride", stride, 1, 64);
    checks.require_range("low_pass", low_pass, 1.0, 64.0);
}

std::optional<double> histogram_distance(const Appearance& source, const Appearance& target) {
    const ExpectedLook look(source);
    return histogram_distance(look, source, target, known_pixels(look, target.normals));
}

TransferMeasures measure_picture(const Appearance& source, const Appearance& target, const MeasureOptions& options,
                                 const WorkContext& work) {
    options.validate();
    require_appearance("source", source.normals, source.picture.size());
    require_appearance("target", target.normals, target.picture.size());
    return on_threads_of(work, [&] { return measured(source, target, options); });
}

TransferMeasures measure_coordinates(const Appearance& source, const NormalMap& target, const cv::Mat2i& coordinates,
                                     const MeasureOptions& options, const WorkContext& work) {
    require_coordinates(coordinates, target.valid, source.picture.size());
    TransferMeasures m =
        measure_picture(source, {target, read_through(source.picture, coordinates, target.valid)}, options, work);
    m.seam = seam(source, target.valid, coordinates);
    if (const std::optional<AngleMeasure> angle = angles(source.normals, target, coordinates)) {
        m.angle_mean_deg = angle->mean_deg;
        m.angle_p95_deg = angle->p95_deg;
    }
    cv::Mat2i inside(coordinates.size(), cv::Vec2i(-1, -1));
    coordinates.copyTo(inside, target.valid);
    m.coherence = coherence(inside);
    m.cover = cover(source.normals.valid, target.valid, coordinates);
    m.background = background(source.normals.valid, target.valid, coordinates);
    return m;
}

}  // namespace darkbox
