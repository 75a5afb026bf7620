#include "processing/texels/neighbourhood.h"

#include <algorithm>

namespace darkbox {
namespace {

cv::Rect window_about(cv::Point centre, int window) {
    return {centre.x - window / 2, centre.y - window / 2, window, window};
}

bool is_whole(const AlbedoMap& albedo, const cv::Rect& square) {
    const cv::Rect image({0, 0}, albedo.valid.size());
    return (square & image) == square && cv::countNonZero(albedo.valid(square)) == square.area();
}

float* write_whole(const AlbedoMap& albedo, const cv::Rect& square, float* to) {
    for (int y = square.y; y < square.y + square.height; ++y)
        to = std::copy_n(albedo.albedo.ptr<float>(y, square.x), 3 * square.width, to);
    return to;
}

float* write_broken(const AlbedoMap& albedo, cv::Point centre, const cv::Rect& square, float* to) {
    const cv::Rect image({0, 0}, albedo.valid.size());
    for (int y = square.y; y < square.y + square.height; ++y)
        for (int x = square.x; x < square.x + square.width; ++x) {
            const cv::Point neighbour(x, y);
            const bool valid = image.contains(neighbour) && albedo.valid(neighbour) != 0;
            to = std::copy_n(albedo.albedo(valid ? neighbour : centre).val, 3, to);
        }
    return to;
}

}  // namespace

Neighbourhoods::Neighbourhoods(const AlbedoMap& albedo, std::vector<cv::Point> pixels, int window)
    : albedo_(albedo), pixels_(std::move(pixels)), whole_(pixels_.size()), window_(window) {
    for (std::size_t i = 0; i < pixels_.size(); ++i) whole_[i] = is_whole(albedo, window_about(pixels_[i], window));
}

void Neighbourhoods::read(std::span<const int> points, float* to) const {
    for (const int point : points) {
        const cv::Rect square = window_about(pixels_[point], window_);
        to = whole_[point] ? write_whole(albedo_, square, to) : write_broken(albedo_, pixels_[point], square, to);
    }
}

}  // namespace darkbox
