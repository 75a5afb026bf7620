#include "processing/calibration/intensity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/calibration/card_intensity.h"

namespace darkbox {
namespace {

constexpr std::array<std::pair<IntensityOrigin, const char*>, 5> names{{{IntensityOrigin::unknown, "unknown"},
                                                                        {IntensityOrigin::given, "given"},
                                                                        {IntensityOrigin::grey_card, "grey card"},
                                                                        {IntensityOrigin::flat, "flat"},
                                                                        {IntensityOrigin::estimated, "estimated"}}};
constexpr double least_cosine = 0.1;         // a light that grazes the card says little of its intensity
constexpr double most_clipped_share = 0.01;  // of the card's pixels
constexpr double least_brightness = 0.1;     // of the picture's brightest parts: a card is no darker
constexpr double brightest_share = 0.01;     // of the picture's pixels
constexpr double noticeable_spread = 1.5;

const char* remedy = "move the card, name another area, or leave that frame out";

/// 255 on the card.
cv::Mat1b pixels_of(const GreyCard& card, cv::Size size) {
    if (card.mask) {
        if (card.mask->size() != size)
            throw InputError(fmt::format("the grey card's mask is {}x{} pixels, the picture {}x{}", card.mask->cols,
                                         card.mask->rows, size.width, size.height),
                             "draw the mask on one of the photographs");
        if (cv::countNonZero(*card.mask) == 0)
            throw InputError("the grey card's mask is black", "make it white on the card");
        return *card.mask;
    }
    if ((card.area & cv::Rect({0, 0}, size)) != card.area)
        throw InputError(
            fmt::format("the grey card at {},{} of {}x{} pixels is not inside the picture of {}x{}", card.area.x,
                        card.area.y, card.area.width, card.area.height, size.width, size.height),
            "give the card's area as X,Y,WIDTH,HEIGHT in pixels");
    cv::Mat1b pixels(size, uchar{0});
    pixels(card.area).setTo(255);
    return pixels;
}

/// Mean of n.L times fall-off over the card: what a light of intensity 1 would make of it, albedo aside.
double expected(const Light& light, const GreyCard& card, const cv::Mat1b& pixels) {
    if (!light.near || !card.view) return std::max(0.0, card.normal.dot(light.direction));
    double sum = 0;
    for (int y = 0; y < pixels.rows; ++y)
        for (int x = 0; x < pixels.cols; ++x) {
            if (pixels(y, x) == 0) continue;
            const Incidence at = incidence(light, card.view->point_at(cv::Point2d(x, y), card.height_mm));
            sum += std::max(0.0, card.normal.dot(at.direction)) * at.falloff;
        }
    return sum / cv::countNonZero(pixels);
}

/// Channel mean that only the brightest hundredth of the picture exceeds.
double brightest_of(const cv::Mat3f& frame) {
    std::vector<float> means;
    means.reserve(frame.total());
    for (const cv::Vec3f& rgb : frame) means.push_back((rgb[0] + rgb[1] + rgb[2]) / 3);
    const auto rank = static_cast<std::ptrdiff_t>((1 - brightest_share) * static_cast<double>(means.size() - 1));
    std::nth_element(means.begin(), means.begin() + rank, means.end());
    return static_cast<double>(means[static_cast<std::size_t>(rank)]);
}

Eigen::Vector3d intensity_of(const cv::Mat3f& frame, const cv::Mat1b& clipped, const Light& light, const GreyCard& card,
                             const cv::Mat1b& pixels) {
    const double geometry = expected(light, card, pixels);
    if (geometry < least_cosine)
        throw InputError(
            fmt::format("the light of {} hardly reaches the grey card: n.L is {:.2f}", light.file, geometry), remedy);
    if (cv::countNonZero(clipped & pixels) > most_clipped_share * cv::countNonZero(pixels))
        throw InputError(fmt::format("the grey card is clipped in {}", light.file), "expose it less");
    const cv::Scalar mean = cv::mean(frame, pixels);
    const Eigen::Vector3d intensity = Eigen::Vector3d(mean[0], mean[1], mean[2]) / geometry;
    if (!(intensity.allFinite() && intensity.minCoeff() > 0) ||
        (mean[0] + mean[1] + mean[2]) / 3 < least_brightness * geometry * brightest_of(frame))
        throw InputError(fmt::format("the grey card is dark in {}", light.file), remedy);
    return intensity;
}

}  // namespace

const char* name(IntensityOrigin origin) {
    for (const auto& [value, text] : names)
        if (value == origin) return text;
    return "";
}

std::optional<IntensityOrigin> intensity_origin_from_name(const std::string& name) {
    for (const auto& [value, text] : names)
        if (name == text) return value;
    return std::nullopt;
}

void GreyCard::validate() const {
    if (!mask && (area.width < 1 || area.height < 1))
        throw InputError(fmt::format("area is {}x{} pixels", area.width, area.height), "allowed: 1x1 or more");
    if (!(std::abs(normal.norm() - 1) < 1e-6))
        throw InputError(fmt::format("normal has the length {}", normal.norm()), "allowed: a unit vector");
}

Eigen::Vector3d intensity_on_card(const cv::Mat3f& frame, const cv::Mat1b& clipped, const Light& light,
                                  const GreyCard& card) {
    card.validate();
    return intensity_of(frame, clipped, light, card, pixels_of(card, frame.size()));
}

Lights with_intensities_of_card(const std::vector<cv::Mat3f>& frames, const std::vector<cv::Mat1b>& clipped,
                                Lights lights, const GreyCard& card) {
    card.validate();
    if (frames.size() != lights.size() || clipped.size() != lights.size())
        throw InputError(fmt::format("{} frames of the grey card for {} lights", frames.size(), lights.size()),
                         "give one frame for each light");
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        lights[i].intensity = intensity_on_card(frames[i], clipped[i], lights[i], card);
    }
    return with_mean_intensity_one(std::move(lights));
}

Lights with_mean_intensity_one(Lights lights) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
    for (const Light& light : lights)
        if (light.used) {
            sum += light.intensity;
            count += 1;
        }
    if (!(count > 0 && sum.minCoeff() > 0)) return lights;
    for (Light& light : lights) light.intensity = count * light.intensity.cwiseQuotient(sum);
    return lights;
}

double intensity_spread(const Lights& lights) {
    Eigen::Vector3d least = Eigen::Vector3d::Constant(HUGE_VAL), most = Eigen::Vector3d::Zero();
    for (const Light& light : lights)
        if (light.used) {
            least = least.cwiseMin(light.intensity);
            most = most.cwiseMax(light.intensity);
        }
    return most.maxCoeff() > 0 ? most.cwiseQuotient(least).maxCoeff() : 1;
}

std::optional<std::string> spread_in_words(const Lights& lights) {
    const double spread = intensity_spread(lights);
    if (!(spread > noticeable_spread)) return std::nullopt;
    return fmt::format("the lamps differ in brightness by {:.2g} times", spread);
}

}  // namespace darkbox
