#include "rig/health/linearity.h"

#include <algorithm>
#include <cmath>

#include "acquisition/frame/error.h"

namespace darkbox {

Linearity measure_linearity(const std::vector<ExposedSignal>& sweep) {
    double products = 0, squares = 0;
    Linearity result;
    for (const ExposedSignal& point : sweep) {
        products += point.exposure.count() * point.signal;
        squares += point.exposure.count() * point.exposure.count();
        result.top = std::max(result.top, point.signal);
    }
    if (sweep.size() < 3 || !(result.top > 0))
        throw InputError("the linearity cannot be told: the exposures show too little light",
                         "raise exposure_ms of [camera], or put a bright object under the lamps");
    for (const ExposedSignal& point : sweep) {
        const double off = std::abs(point.signal - products / squares * point.exposure.count()) / result.top;
        if (off <= result.deviation) continue;
        result.deviation = off;
        result.worst = point.exposure;
    }
    return result;
}

}  // namespace darkbox
