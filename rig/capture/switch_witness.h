#pragma once

#include <functional>
#include <vector>

#include "rig/capture/picture.h"

namespace darkbox {

/// The frame during whose exposure the lamps were switched: it holds the lamp of before and the lamp of after in the
/// shares that its timestamp lets expect, or the timestamp lies. Bands of rows are looked at one by one, as the rows of
/// a rolling shutter are exposed one after another.
struct WitnessPictures {
    const Picture* dark = nullptr;
    const Picture* before = nullptr;  ///< lit by the lamp of before; null: it was dark
    const Picture* spoiled = nullptr;
    const Picture* after = nullptr;  ///< lit by the lamp of after; null: it was dark then
};

/// Shares of an exposure's light, of the lamp of before and of the lamp of after.
struct LightShares {
    double before = 0.0;
    double after = 0.0;
};

/// The shares that the timestamps let expect in the row at `height` of the picture: 0 = first row, 1 = last.
using ExpectedShares = std::function<LightShares(double height)>;

/// What an honest frame may differ by from what is expected, in shares of an exposure.
struct WitnessTolerance {
    double late = 0.0;  ///< the lamps switched later than they were told, or the frame was exposed earlier than it says
    double early = 0.0;  ///< the other way round
};

struct WitnessReport {
    /// Some band shows a part of an exposure: had the stamps been off by more than the tolerance, it would show.
    bool informative = false;
    bool agrees = true;
    double latest = 0.0;    ///< the largest difference the one way, in shares of an exposure
    double earliest = 0.0;  ///< and the other
};

/// Whether a frame of which this is expected can be a witness, its noise aside: some band of its rows shows such a part
/// of an exposure. `lit_after`: there is a lamp of after.
bool can_tell(const ExpectedShares& expected, int rows, bool lit_after, const WitnessTolerance& tolerance);

WitnessReport hear_witness(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale,
                           const ExpectedShares& expected, const WitnessTolerance& tolerance);

/// Of a frame that should hold the light of after alone: what bands of rows hold of before, and lack, beyond what
/// noise explains.
struct BandLights {
    double most_before = 0.0;   ///< share of before's light
    double most_missing = 0.0;  ///< share of after's light, too much of it counted as well
};
BandLights compare_bands(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale);

/// How much of after's light a band of rows holds; `pictures.before` is null. Bands that cannot tell are left out.
struct BandShare {
    double height = 0.0;  ///< of the band's middle: 0 = first row, 1 = last
    double share = 0.0;
    double sigma = 0.0;
};
std::vector<BandShare> band_shares(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale);

}  // namespace darkbox
