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
    void add(const PhotoStack& stack);

    /// A sentence for each photograph of a used light that is black, or clipped on most of the object, with the remedy.
    std::vector<std::string> warnings(const Lights& lights) const;

private:
    struct Frame {
        std::string file;
        double radiance = 0;  ///< summed over the object, channel mean
        std::size_t clipped = 0;
    };
    double typical_radiance() const;

    std::vector<Frame> frames_;
    std::size_t pixels_ = 0;  ///< of the object
};

}  // namespace darkbox
