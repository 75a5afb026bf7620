#pragma once

#include <vector>

#include "acquisition/frame/units.h"

namespace darkbox {

/// What the same light gave in one exposure.
struct ExposedSignal {
    Seconds exposure{0};
    double signal = 0;  ///< above the dark frame; 1 = full scale
};

/// How far a camera is from giving twice the signal for twice the light.
struct Linearity {
    double deviation = 0;  ///< the largest distance from the line, as a share of the largest signal
    Seconds worst{0};      ///< the exposure where that is
    double top = 0;        ///< the largest signal; 1 = full scale
};

/// The line is fitted by least squares through the origin: photometric stereo takes signal for proportional to light,
/// so an offset is a deviation as well. (EMVA 1288, release 3.1, section 7, leaves an offset free; a steady error of
/// the exposure time therefore shows here and not there.) Needs three exposures or more.
Linearity measure_linearity(const std::vector<ExposedSignal>& sweep);

}  // namespace darkbox
