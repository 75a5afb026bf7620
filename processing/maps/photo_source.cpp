#include "processing/maps/photo_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

std::vector<PhotoRows> photos_of(const PhotoStack& stack) {
    require_consistent(stack);
    std::vector<PhotoRows> photos(stack.images.size());
    for (std::size_t i = 0; i < photos.size(); ++i) {
        photos[i].samples = stack.images[i];
        photos[i].clipped = stack.clipped[i];
    }
    return photos;
}

/// Only headers are copied.
PhotoRows rows_of(const PhotoRows& photo, cv::Range range) {
    PhotoRows rows = photo;
    rows.samples = photo.samples.rowRange(range);
    if (!photo.dark.empty()) rows.dark = photo.dark.rowRange(range);
    if (!photo.clipped.empty()) rows.clipped = photo.clipped.rowRange(range);
    return rows;
}

template <class Sample>
void linear_row(const PhotoRows& rows, int row, float* radiance) {
    const auto* samples = rows.samples.ptr<Sample>(row);
    const float* dark = rows.dark.empty() ? nullptr : rows.dark.ptr<float>(row);
    const int n = 3 * rows.samples.cols;
    for (int i = 0; i < n; ++i)
        radiance[i] = (static_cast<float>(samples[i]) - (dark ? dark[i] : rows.black)) * rows.scale;
}

template <class Sample>
void curved_row(const PhotoRows& rows, int row, float* radiance) {
    const auto* samples = rows.samples.ptr<Sample>(row);
    const std::vector<float>& curve = *rows.curve;
    for (int i = 0; i < 3 * rows.samples.cols; ++i) radiance[i] = curve[samples[i]];
}

template <class Sample>
void clipped_row(const PhotoRows& rows, int row, uchar* clipped) {
    const auto* s = rows.samples.ptr<Sample>(row);
    for (int x = 0; x < rows.samples.cols; ++x, s += 3)
        clipped[x] = static_cast<float>(std::max({s[0], s[1], s[2]})) >= rows.limit ? 255 : 0;
}

}  // namespace

PhotosInMemory::PhotosInMemory(std::vector<PhotoRows> photos, const std::vector<std::string>& files, cv::Mat1b mask)
    : photos_(std::move(photos)), mask_(std::move(mask)) {
    if (photos_.empty()) throw InputError("there are no photographs", "give at least three");
    for (std::size_t i = 0; i < photos_.size(); ++i)
        if (photos_[i].samples.size() != mask_.size())
            throw InputError(
                fmt::format("{} is {}x{} pixels but the mask is {}x{}", i < files.size() ? files[i] : "a photograph",
                            photos_[i].samples.cols, photos_[i].samples.rows, mask_.cols, mask_.rows),
                "give photographs and a mask of one size");
}

PhotosInMemory::PhotosInMemory(const PhotoStack& stack) : PhotosInMemory(photos_of(stack), stack.files, stack.mask) {}

void PhotosInMemory::read_next(int rows, PhotoBand& band) {
    const cv::Range range(next_row_, next_row_ + rows);
    band.first_row = next_row_;
    band.mask = mask_.rowRange(range);
    band.photos.clear();
    for (const PhotoRows& photo : photos_) band.photos.push_back(rows_of(photo, range));
    next_row_ += rows;
}

void radiance_row(const PhotoRows& rows, int row, cv::Vec3f* radiance) {
    float* out = radiance->val;
    const int depth = rows.samples.depth();
    if (depth == CV_32F)
        linear_row<float>(rows, row, out);
    else if (rows.curve)
        depth == CV_8U ? curved_row<uchar>(rows, row, out) : curved_row<ushort>(rows, row, out);
    else
        depth == CV_8U ? linear_row<uchar>(rows, row, out) : linear_row<ushort>(rows, row, out);
}

cv::Mat3f radiance_of(const PhotoRows& rows) {
    cv::Mat3f radiance(rows.samples.size());
    for (int y = 0; y < radiance.rows; ++y) radiance_row(rows, y, radiance[y]);
    return radiance;
}

cv::Mat1b clipped_of(const PhotoRows& rows) {
    if (!rows.clipped.empty()) return rows.clipped;
    cv::Mat1b clipped(rows.samples.size());
    for (int y = 0; y < clipped.rows; ++y) switch (rows.samples.depth()) {
            case CV_8U:
                clipped_row<uchar>(rows, y, clipped[y]);
                break;
            case CV_16U:
                clipped_row<ushort>(rows, y, clipped[y]);
                break;
            default:
                clipped_row<float>(rows, y, clipped[y]);
        }
    return clipped;
}

}  // namespace darkbox
