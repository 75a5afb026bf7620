#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/formats/srgb.h"
#include "processing/pipeline/stack.h"

namespace darkbox {
namespace {

constexpr double ball_margin = 1.08;  // of the radius: the ball's rim and its glow

/// The greatest luminance that each pixel showed under any lamp.
cv::Mat1f brightest(const std::vector<cv::Mat3f>& images) {
    cv::Mat1f most(images.front().size(), 0.0F);
    for (const cv::Mat3f& image : images) most = cv::max(most, mean_channel(image));
    return most;
}

/// Eight bits on a square-root scale, so that Otsu's threshold sees dark objects too.
cv::Mat1b encoded(const cv::Mat1f& luminance) {
    double peak = 0;
    cv::minMaxLoc(luminance, nullptr, &peak);
    cv::Mat1f root;
    cv::sqrt(luminance / std::max(peak, 1e-12), root);
    cv::Mat1b bytes;
    root.convertTo(bytes, CV_8U, 255.0);
    return bytes;
}

void leave_out(cv::Mat1b& mask, const std::vector<cv::Vec3d>& discs) {
    for (const cv::Vec3d& disc : discs)
        cv::circle(mask, {static_cast<int>(std::lround(disc[0])), static_cast<int>(std::lround(disc[1]))},
                   static_cast<int>(std::ceil(disc[2] * ball_margin)), cv::Scalar(0), cv::FILLED);
}

cv::Mat1b largest_part_filled(const cv::Mat1b& mask) {
    std::vector<std::vector<cv::Point>> outlines;
    cv::findContours(mask, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    const auto largest = std::max_element(outlines.begin(), outlines.end(), [](const auto& a, const auto& b) {
        return cv::contourArea(a) < cv::contourArea(b);
    });
    if (largest == outlines.end())
        throw InputError("no object is told from the background in the photographs",
                         "give a mask (white on the object), or light the object better");
    cv::Mat1b filled(mask.size(), uchar{0});
    cv::drawContours(filled, outlines, static_cast<int>(largest - outlines.begin()), cv::Scalar(255), cv::FILLED);
    return filled;
}

}  // namespace

cv::Mat1b automatic_mask(const std::vector<cv::Mat3f>& images, const std::vector<cv::Vec3d>& without) {
    if (images.empty()) throw InputError("there are no photographs", "give a session with lit frames");
    cv::Mat1b mask;
    cv::threshold(encoded(brightest(images)), mask, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
    leave_out(mask, without);
    cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {3, 3}));
    return largest_part_filled(mask);
}

}  // namespace darkbox
