#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/drift.h"
#include "rig/description/rig_description.h"

namespace darkbox {

/// What is known of where the lamps stand, before a capture.
struct KnownLamps {
    RigLights lights;           ///< near lamps where places are known, else distant ones; viewer frame
    std::string source;         ///< "rig.toml", "the calibration of vase-1"
    double sigma_deg = 1.0;     ///< of each direction, per tangent axis
    double moved_deg = 3.0;     ///< a lamp further from its place is worth a word
    bool camera_known = false;  ///< lights were seen by this camera, so that it matters when all are turned alike
};

/// A frame of one lamp, made so small that those of all lamps are held at once.
struct LampPicture {
    std::string lamp;
    cv::Mat1f light;    ///< above the black level; 1 = full scale
    double factor = 1;  ///< pixels of the frame to one of this, across
};

/// Directions to the lamps as a mirror ball shows them.
struct BallPlaces {
    Ball ball;                               ///< in the frame's pixels
    RigLights lights;                        ///< distant: from the ball; unused where it shows no image of the lamp
    std::optional<Eigen::Vector3d> ball_mm;  ///< viewer frame; none: the scale of the pictures is not known
};

/// No value where the pictures show no mirror ball. All pictures are of one size.
std::optional<BallPlaces> places_on_ball(const std::vector<LampPicture>& pictures, const RigDescription& rig);

/// One thing that is wrong.
struct PlaceFinding {
    std::vector<std::string> unlike;  ///< lamps whose frames show another lamp's light; empty: all are what they say
    std::string words;                ///< a sentence
};

/// Lamps that are exchanged, driven by another's output, or moved, and a camera that was knocked. Nothing where fewer
/// than half of the lamps stand where they are known to, unless the others have taken each other's places: then it is
/// no mirror ball that was found.
std::vector<PlaceFinding> compare_places(const BallPlaces& seen, const KnownLamps& known);

}  // namespace darkbox
