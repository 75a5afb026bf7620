#include "processing/transfer/texel_bytes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace darkbox {
namespace {

/// Codes of white albedo and of a unit normal's component at equal weights. That white is about as far from black as
/// the normal of a plane from one at its side makes colours and normals of a transferred texture equally wrong; and
/// there is head-room for what is brighter than white.
constexpr double white_code = 127;
constexpr double unit_code = 127.5;
constexpr int steps = 4096;
constexpr double highest = 2;  ///< times white; what is brighter yet is cut

std::uint8_t byte(double value) { return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)); }

/// Codes of linear values in steps of `highest` / `steps` in their square root, which is near to the gamma.
std::array<std::uint8_t, steps + 1> albedo_codes(double scale) {
    std::array<std::uint8_t, steps + 1> codes{};
    for (int i = 0; i <= steps; ++i) {
        const double root = i * (std::sqrt(highest) / steps);
        codes[i] = byte(scale * white_code * std::pow(root, 2 / 2.2));
    }
    return codes;
}

}  // namespace

TexelBytes::TexelBytes(cv::Size size, int channels)
    : size_(size),
      channels_(channels),
      stride_(static_cast<std::size_t>(size.width + 2 * margin) * static_cast<std::size_t>(channels)),
      bytes_(stride_ * static_cast<std::size_t>(size.height + 2 * margin) + longest_row, std::uint8_t{0}),
      present_(static_cast<std::size_t>(places()), std::uint8_t{0}) {}

TexelBytes texel_bytes(const MapLevel& level, const MapLevel* control, const TexelCode& code) {
    TexelBytes bytes(level.valid.size(), code.channels());
    // The heaviest channel has the whole byte.
    const double heaviest = std::sqrt(std::max({1.0, code.normal_weight, code.has_control ? code.control_weight : 0}));
    const auto albedo = albedo_codes(1 / heaviest);
    const double unit = unit_code * std::sqrt(code.normal_weight) / heaviest;
    const double control_scale = white_code * std::sqrt(code.control_weight) / heaviest;
    const auto albedo_code = [&](float value) {
        const double share = std::clamp(value / code.white / highest, 0.0, 1.0);
        return albedo[static_cast<std::size_t>(std::lround(std::sqrt(share) * steps))];
    };
    tbb::parallel_for(0, bytes.size().height, [&](int y) {
        for (int x = 0; x < bytes.size().width; ++x) {
            if (!level.valid(y, x)) continue;
            bytes.add({x, y});
            std::uint8_t* b = bytes.at({x, y});
            for (int c = 0; c < 3; ++c) {
                b[c] = albedo_code(level.albedo(y, x)[c]);
                b[3 + c] = byte(unit_code + unit * level.normal(y, x)[c]);
                if (control) b[6 + c] = byte(control_scale * control->albedo(y, x)[c]);
            }
        }
    });
    return bytes;
}

}  // namespace darkbox
