#pragma once

#include <optional>
#include <string>

#include "processing/maps/maps.h"

namespace darkbox {

/// What photographs leave unexplained by distant lights under Lambert's law, as shares of their samples' RMS.
struct LightsFit {
    double given = 0;     ///< by these lights
    double shuffled = 0;  ///< by the same lights in another order: the median of many orders
    double free = 0;      ///< by the best three images whatever the lights: no order of any lights leaves less

    /// What these lights add to the least possible, as a share of what a shuffled order adds: near 0 for the right
    /// lights whatever the material's gloss and shadows, near 1 for lights that have nothing to do with the
    /// photographs.
    double excess() const;
};

/// Over pixels of the mask that no used light clips; none where these or the lights are too few to tell, or a used
/// light is near. Each light's
/// samples are divided by its intensity. Deterministic.
std::optional<LightsFit> lights_fit(const PhotoStack& stack, const Lights& lights);

/// A sentence with the remedy where lights explain the photographs hardly better than the same lights in any other
/// order: docs/decisions/0055.
std::optional<std::string> lights_warning(const PhotoStack& stack, const Lights& lights);

}  // namespace darkbox
