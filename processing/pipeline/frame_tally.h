#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox {

/// Counts how bright and how clipped each photograph is on the object, to tell those that no solver can make good.
/// Bands of one stack's rows may be added one after the other. Thread-compatible.
class FrameTally {
public:
    /// One light for each photograph.
    void add(const PhotoStack& stack, const Lights& lights);

    /// The photographs of used lights that are black on the object: their lamps were not on.
    std::vector<std::size_t> black(const Lights& lights) const;
    /// A sentence for each photograph of a used light that is clipped on most of the object, and one where part of the
    /// object is clipped under so many that too few are left, with the remedy.
    std::vector<std::string> warnings(const Lights& lights) const;

private:
    struct Frame {
        std::string file;
        double radiance = 0;  ///< summed over the object, channel mean
        std::size_t clipped = 0;
    };
    double typical_radiance() const;

    std::vector<Frame> frames_;
    std::size_t pixels_ = 0;       ///< of the object
    std::size_t overexposed_ = 0;  ///< clipped under all used lights but two or fewer
};

}  // namespace darkbox
