#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "processing/transfer/pyramid.h"

namespace darkbox {

/// Albedo, normal and where there is one the control map, interleaved in one byte each, so that a row of a patch is one
/// run of bytes. The difference of two patches is then the sum of squared differences of their bytes.
class TexelBytes {
public:
    /// Half of the largest window: patches may hang over the border by this much.
    static constexpr int margin = 7;
    /// Bytes that may be read from the first one of a patch's row, however short it is.
    static constexpr int longest_row = 160;

    TexelBytes(cv::Size size, int channels);

    cv::Size size() const { return size_; }
    int channels() const { return channels_; }
    std::size_t stride() const { return stride_; }

    /// With the margin: rows of so many texels, so many texels in all.
    int pitch() const { return size_.width + 2 * margin; }
    int places() const { return pitch() * (size_.height + 2 * margin); }
    /// A texel as one number: steps to neighbours are differences of places. x and y may lie up to `margin` outside.
    int place(cv::Point p) const { return (p.y + margin) * pitch() + p.x + margin; }
    cv::Point point(int place) const { return {place % pitch() - margin, place / pitch() - margin}; }
    /// A place in the margin, as are those up to 3 steps away in x and y.
    int nowhere() const { return place({3 - margin, 3 - margin}); }

    /// Whether there is a valid texel at a place of 0...places() - 1.
    bool has(int place) const { return present_[static_cast<std::size_t>(place)] != 0; }
    void add(cv::Point p) { present_[static_cast<std::size_t>(place(p))] = 1; }

    /// Where nothing was written, every byte is 0.
    const std::uint8_t* at(int place) const { return bytes_.data() + offset(place); }
    const std::uint8_t* at(cv::Point p) const { return at(place(p)); }
    std::uint8_t* at(cv::Point p) { return bytes_.data() + offset(place(p)); }

private:
    cv::Size size_;
    int channels_;
    std::size_t stride_;
    std::vector<std::uint8_t> bytes_;
    std::vector<std::uint8_t> present_;

    std::size_t offset(int place) const {
        return static_cast<std::size_t>(place) * static_cast<std::size_t>(channels_);
    }
};

/// How maps become bytes.
struct TexelCode {
    float white;                ///< linear albedo that gets the code of white
    double normal_weight = 1;   ///< weight of squared differences of normals against those of albedo
    double control_weight = 0;  ///< likewise of the control map
    bool has_control = false;

    int channels() const { return has_control ? 9 : 6; }
};

/// The bytes of the level's valid pixels, with the control map's level beside it (its albedo is the control map; null
/// for none). Albedo is encoded with a gamma of 2.2, so that equal differences look equal in dark and light.
TexelBytes texel_bytes(const MapLevel& level, const MapLevel* control, const TexelCode& code);

}  // namespace darkbox
