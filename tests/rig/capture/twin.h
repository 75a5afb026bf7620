#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "rig/capture/capture_session.h"
#include "rig/capture/meter.h"
#include "sim/sim_rig.h"
#include "tests/support/test_data.h"

namespace darkbox::test {

/// The digital twin with six lamps and a small picture, and a folder for its sessions. Change `rig` before the first
/// use of anything else.
struct Twin {
    explicit Twin(std::string faults = "") : faults_(std::move(faults)) {
        rig.sim.width = 160;
        rig.sim.height = 120;
        rig.camera.mm_per_pixel = 1.25;
    }

    sim::SimRig& sim() {
        if (!sim_) sim_.emplace(sim::SimRig::make(rig, sim::parse_faults(faults_)));
        return *sim_;
    }
    CaptureDevices devices() { return {sim().lamps(), sim().camera(), sim().clock()}; }
    CapturedSession capture(const CaptureRequest& request) {
        return capture_session(request, rig, sim().lamps(), sim().camera(), sim().clock());
    }
    Session capture(std::optional<ExposureChoice> exposure = {}) {
        return capture({.folder = folder.path() / "session", .object = "a twin", .lamps = {}, .exposure = exposure})
            .session;
    }
    Metering meter() {
        const CaptureDevices used = devices();
        return meter_exposure(rig, lamps_named(rig, {}), used);
    }

    TemporaryFolder folder;
    RigDescription rig = parse_rig(simulated_rig_toml(6), "rig.toml");

private:
    std::string faults_;
    std::optional<sim::SimRig> sim_;
};

/// Of a frame of 16-bit samples.
inline double brightest_sample(const Frame& frame, std::size_t pixel) {
    const auto count = static_cast<std::size_t>(channels(frame.format));
    std::uint16_t most = 0;
    for (std::size_t channel = 0; channel < count; ++channel) {
        std::uint16_t sample = 0;
        std::memcpy(&sample, frame.pixels.data() + 2 * (pixel * count + channel), sizeof sample);
        most = std::max(most, sample);
    }
    return most;
}

}  // namespace darkbox::test
