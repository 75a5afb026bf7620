#pragma once

#include "acquisition/frame/units.h"

namespace darkbox {

/// The moment that a driver stamps on a buffer.
enum class StampedMoment {
    end_of_frame,        ///< the last sample was received
    start_of_exposure,   ///< of the first row
    start_of_reception,  ///< the first sample was received: the first row's exposure was over
};

/// First row's begin to last row's end, and never less than that. `readout`: from the first row's end to the last's, or
/// more where it is not known.
constexpr Interval exposure_interval(TimePoint stamp, StampedMoment moment, Nanoseconds exposure, Nanoseconds readout) {
    switch (moment) {
        case StampedMoment::end_of_frame:
            return {stamp - readout - exposure, stamp};
        case StampedMoment::start_of_exposure:
            return {stamp, stamp + exposure + readout};
        case StampedMoment::start_of_reception:
            break;
    }
    return {stamp - exposure, stamp + readout};
}

}  // namespace darkbox
