#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/stack.h"

namespace darkbox {
namespace {

constexpr double ball_margin = 1.08;     // of the radius: the ball's rim and its glow
constexpr double max_hole_share = 0.01;  // of the object's area

/// The greatest luminance that each pixel showed under any lamp.
cv::Mat1f brightest(const std::vector<cv::Mat3f>& images) {
    cv::Mat1f most(images.front().size(), 0.0F);
    for (const cv::Mat3f& image : images) most = cv::max(most, mean_channel(image));
    return most;
}

/// The greatest value that is not a single pixel's: one hot pixel of a float picture would make all others black.
double peak_of(const cv::Mat1f& luminance) {
    cv::Mat1f calm;
    cv::medianBlur(luminance, calm, 3);
    double peak = 0;
    cv::minMaxLoc(calm, nullptr, &peak);
    return std::max(peak, 1e-12);
}

/// Eight bits on a square-root scale, so that Otsu's threshold sees dark objects too.
cv::Mat1b encoded(const cv::Mat1f& luminance) {
    cv::Mat1f root;
    cv::sqrt(cv::min(luminance / peak_of(luminance), 1.0), root);
    cv::Mat1b bytes;
    root.convertTo(bytes, CV_8U, 255.0);
    return bytes;
}

void leave_out(cv::Mat1b& mask, const std::vector<cv::Vec3d>& discs) {
    for (const cv::Vec3d& disc : discs)
        cv::circle(mask, {static_cast<int>(std::lround(disc[0])), static_cast<int>(std::lround(disc[1]))},
                   static_cast<int>(std::ceil(disc[2] * ball_margin)), cv::Scalar(0), cv::FILLED);
}

/// The parts of a mask, labelled from 1, and how many pixels each has; part 0 is where the mask is black.
struct Parts {
    explicit Parts(const cv::Mat1b& mask, int connectivity) {
        cv::Mat1i statistics;
        cv::Mat1d centroids;
        const int count = cv::connectedComponentsWithStats(mask, label, statistics, centroids, connectivity, CV_32S);
        for (int part = 0; part < count; ++part) areas.push_back(statistics(part, cv::CC_STAT_AREA));
    }
    cv::Mat1i label;
    std::vector<int> areas;
};

cv::Mat1b largest_part(const cv::Mat1b& mask) {
    const Parts parts(mask, 8);
    const auto largest = std::max_element(parts.areas.begin() + 1, parts.areas.end());
    if (largest == parts.areas.end())
        throw InputError("no object is told from the background in the photographs",
                         "give a mask (white on the object), or light the object better");
    cv::Mat1b part;
    cv::compare(parts.label, static_cast<double>(largest - parts.areas.begin()), part, cv::CMP_EQ);
    return part;
}

/// A small hole is a dark spot on the object; a large one shows the box behind it (a ring, a handle).
cv::Mat1b with_small_holes_filled(const cv::Mat1b& mask) {
    cv::Mat1b background;
    cv::bitwise_not(mask, background);
    const Parts holes(background, 4);
    const double limit = max_hole_share * cv::countNonZero(mask);
    cv::Mat1b filled = mask.clone();
    for (int y = 0; y < mask.rows; ++y)
        for (int x = 0; x < mask.cols; ++x)
            if (const int hole = holes.label(y, x); hole > 0 && holes.areas[static_cast<std::size_t>(hole)] < limit)
                filled(y, x) = 255;
    return filled;
}

}  // namespace

cv::Mat1b mask_of_brightest(const cv::Mat1f& brightest, const std::vector<cv::Vec3d>& without) {
    cv::Mat1b mask;
    cv::threshold(encoded(brightest), mask, 0, 255, cv::THRESH_BINARY | cv::THRESH_OTSU);
    leave_out(mask, without);
    cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_ELLIPSE, {3, 3}));
    return with_small_holes_filled(largest_part(mask));
}

cv::Mat1b automatic_mask(const std::vector<cv::Mat3f>& images, const std::vector<cv::Vec3d>& without) {
    if (images.empty()) throw InputError("there are no photographs", "give a session with lit frames");
    return mask_of_brightest(brightest(images), without);
}

}  // namespace darkbox
