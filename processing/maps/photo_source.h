#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

/// Some rows of one photograph as they were decoded, and what makes radiance of them: (sample - black) * scale, or the
/// curve's value. Samples stay as narrow as the file has them, so that many photographs fit into memory.
struct PhotoRows {
    cv::Mat samples;                                       ///< CV_8UC3, CV_16UC3 or CV_32FC3, channels R, G, B
    float black = 0.0F;                                    ///< sample units
    float scale = 1.0F;                                    ///< radiance of one sample unit
    float limit = std::numeric_limits<float>::infinity();  ///< a pixel with a sample at or above it is clipped
    cv::Mat3f dark;     ///< the lamps-off frame's rows, sample units; where not empty it stands in for `black`
    cv::Mat1b clipped;  ///< 255 where clipped; where not empty it stands in for `limit`
    std::shared_ptr<const std::vector<float>>
        curve;  ///< radiance of every sample value, for 8 and 16 bits; none: linear
};

/// The same rows of all photographs.
struct PhotoBand {
    int first_row = 0;              ///< in the picture
    std::vector<PhotoRows> photos;  ///< all of one size
    cv::Mat1b mask;                 ///< 255 on the object; empty: the whole band is to be solved

    int rows() const { return photos.empty() ? 0 : photos.front().samples.rows; }
    int cols() const { return photos.empty() ? 0 : photos.front().samples.cols; }
};

/// Photographs of one object under one lamp each that are read from the top, band by band. Thread-compatible.
class PhotoSource {
public:
    virtual ~PhotoSource() = default;

    virtual cv::Size size() const = 0;
    virtual std::size_t count() const = 0;  ///< photographs
    /// Memory that one more row in a band takes.
    virtual std::size_t bytes_per_row() const = 0;
    /// Memory that reading takes besides the bands, such as what a map found on the way needs.
    virtual std::size_t bytes_held() const = 0;

    /// Puts the next `rows` rows of every photograph into `band`, whose buffers it uses again where they fit. Reads
    /// photographs in parallel. Throws InputError that names the file at fault.
    virtual void read_next(int rows, PhotoBand& band) = 0;
    /// The next band is the top one again.
    virtual void rewind() = 0;

    /// 255 on the object. Where the bands came without one it was found on the way: ask after the last band.
    virtual cv::Mat1b mask() const = 0;
};

/// Photographs that are in memory already: bands are views of them.
class PhotosInMemory : public PhotoSource {
public:
    /// `photos` hold whole pictures. What they refer to must not change meanwhile. Throws InputError when sizes differ
    /// or there are none; `files` names them then.
    PhotosInMemory(std::vector<PhotoRows> photos, const std::vector<std::string>& files, cv::Mat1b mask);
    /// Throws InputError as require_consistent() does.
    explicit PhotosInMemory(const PhotoStack& stack);

    cv::Size size() const override { return mask_.size(); }
    std::size_t count() const override { return photos_.size(); }
    std::size_t bytes_per_row() const override { return 0; }
    std::size_t bytes_held() const override { return 0; }
    void read_next(int rows, PhotoBand& band) override;
    void rewind() override { next_row_ = 0; }
    cv::Mat1b mask() const override { return mask_; }

private:
    std::vector<PhotoRows> photos_;
    cv::Mat1b mask_;
    int next_row_ = 0;
};

/// Rows as linear radiance, by the formula at PhotoRows.
cv::Mat3f radiance_of(const PhotoRows& rows);
/// 255 where any channel is at the limit.
cv::Mat1b clipped_of(const PhotoRows& rows);

/// One row's linear radiance into `radiance`, which has a place for every column. For loops that visit many rows.
void radiance_row(const PhotoRows& rows, int row, cv::Vec3f* radiance);

}  // namespace darkbox
