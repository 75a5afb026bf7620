#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "acquisition/frame/frame.h"
#include "rig/description/rig_description.h"
#include "sim/scenes.h"
#include "sim/sim_rig.h"

namespace darkbox::sim {

constexpr Nanoseconds second{1'000'000'000};

/// The next frame of a camera that streams; fails after a second without one.
inline Frame next(SimRig& rig) { return rig.camera().next_frame(rig.clock().now() + second); }

/// Lamps one metre away at these directions (need not be of unit length).
inline std::vector<LampDescription> lamps_at(const std::vector<std::array<double, 3>>& directions) {
    std::vector<LampDescription> lamps;
    for (const auto& d : directions) {
        const double scale = 1000.0 / std::hypot(d[0], d[1], d[2]);
        LampDescription lamp;
        lamp.name = "lamp-" + std::to_string(lamps.size() + 1);
        lamp.channel = static_cast<int>(lamps.size());
        lamp.position_mm = {d[0] * scale, d[1] * scale, d[2] * scale};
        lamps.push_back(lamp);
    }
    return lamps;
}

/// A small rig with three lamps: from above, from the right, from the camera.
inline RigDescription small_rig(const std::string& scene = "sphere-lambert") {
    RigDescription rig;
    rig.name = "test";
    rig.sim.scene = scene;
    rig.sim.width = 64;
    rig.sim.height = 48;
    rig.lamps = lamps_at({{0, 0.7, 1}, {0.7, 0, 1}, {0, 0, 1}});
    return rig;
}

inline Scene scene_of(const std::string& name, int width, const std::vector<LampDescription>& lamps) {
    SimDescription sim;
    sim.scene = name;
    sim.width = width;
    sim.height = width * 3 / 4;
    return scene_by_name(sim, lamps);
}

/// A frame's sample as a number.
inline int sample(const Frame& frame, std::size_t index) {
    if (frame.format == PixelFormat::rgb8) return std::to_integer<int>(frame.pixels.at(index));
    return std::to_integer<int>(frame.pixels.at(2 * index)) |
           (std::to_integer<int>(frame.pixels.at(2 * index + 1)) << 8);
}

/// Mean over a frame above the black level, sample units.
inline double mean_signal(const Frame& frame) {
    const std::size_t count = 3 * static_cast<std::size_t>(frame.width) * frame.height;
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum += sample(frame, i);
    return sum / static_cast<double>(count) - frame.black_level;
}

/// The same over the right half, where the object is and the ball, whose highlight clips, is not.
inline double mean_signal_right(const Frame& frame) {
    double sum = 0.0;
    for (int v = 0; v < frame.height; ++v)
        for (int i = 3 * (frame.width / 2); i < 3 * frame.width; ++i)
            sum += sample(frame, static_cast<std::size_t>(3 * frame.width * v + i));
    return sum / (3.0 * frame.height * (frame.width - frame.width / 2)) - frame.black_level;
}

}  // namespace darkbox::sim
