#pragma once

#include <fmt/format.h>

#include "acquisition/frame/error.h"

namespace darkbox {

/// Refuses options that make no sense, by their names.
struct OptionChecks {
    const char* whose;  ///< the first word of every message

    /// Throws InputError outside [low, high].
    template <class Number>
    void require_range(const char* field, Number value, Number low, Number high) const {
        if (value >= low && value <= high) return;
        throw InputError(fmt::format("{}: {} is {}, but it must be {}...{}", whose, field, value, low, high),
                         fmt::format("set {} within its range", field));
    }

    void require_odd(const char* field, int value) const {
        if (value % 2 != 0) return;
        throw InputError(fmt::format("{}: {} is {}, but it must be odd", whose, field, value),
                         fmt::format("set {} to an odd number of pixels, such as 5", field));
    }
};

}  // namespace darkbox
