#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace darkbox {

/// What the robust solver made of one photograph's sample of one pixel. The values are those of the grey pictures that
/// show it.
enum class SampleUse : std::uint8_t {
    no_normal = 0,    ///< the pixel has none
    shadow = 64,      ///< attached, near its edge, or cast: darker than the fit
    clipped = 128,    ///< at the sensor's limit
    highlight = 192,  ///< brighter than the fit with the gloss that is known
    kept = 255,       ///< counts in the normal
};

/// Takes the uses of samples as they become known: those of one row of one photograph at a time, rows in any order and
/// more than once, several threads at once. The last of a row holds.
class SampleUseSink {
public:
    SampleUseSink() = default;
    SampleUseSink(const SampleUseSink&) = delete;
    SampleUseSink& operator=(const SampleUseSink&) = delete;
    virtual ~SampleUseSink() = default;
    /// `photograph`: its place in the stack.
    virtual void take(int row, std::size_t photograph, std::span<const SampleUse> uses) = 0;
};

}  // namespace darkbox
