#pragma once

#include <cstddef>
#include <opencv2/core.hpp>

namespace darkbox {

/// Memory that integrate_normals() takes at its worst for normals whose valid pixels lie in a box of this size, beside
/// what it is given and what it returns.
inline std::size_t integration_bytes(cv::Size box) {
    constexpr std::size_t a_pixel = 130;  // measured; slopes, weights, heights and the solver's levels
    return a_pixel * static_cast<std::size_t>(box.area());
}

}  // namespace darkbox
