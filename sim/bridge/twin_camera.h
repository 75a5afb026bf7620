#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "acquisition/device/clock.h"
#include "sim/bridge/lamp_view.h"
#include "sim/bridge/shared_line.h"
#include "sim/bridge/twin_pictures.h"
#include "sim/bridge/usbip_port.h"
#include "sim/bridge/uvc_camera.h"

namespace darkbox::sim {

/// What is done to the camera from outside; may be set by a signal's handler.
struct TwinOrders {
    std::atomic<bool> damage_next = false;  ///< the next frame is sent with the error bit
    std::atomic<bool> unplug = false;       ///< now, for a while
    std::atomic<bool> leave = false;
};

struct TwinOptions {
    UvcCamera::Mode mode;
    Sensor sensor;
    int port = 0;                  ///< of the virtual USB host
    Seconds unplugged{3.0};        ///< how long it stays away
    SharedLine* strobe = nullptr;  ///< up while it exposes; not owned
};

/// The digital twin behind the kernel's own camera driver: a free-running global-shutter USB camera that sees the scene
/// in the light of the lamps that burned during each exposure. Exposures begin at whole periods after the first; one
/// that it is not ready for is left out. Thread-compatible.
class TwinCamera {
public:
    TwinCamera(const TwinPictures& pictures, const LampView& lamps, Clock& clock, const TwinOptions& options,
               TwinOrders& orders);

    /// Until told to leave. Throws DeviceError.
    void run();

private:
    void stay_plugged_in();
    void wait_for_its_turn(UsbIpPort& port);
    void frame(UvcCamera& camera, UsbIpPort& port);
    std::vector<double> watch_lamps(Seconds exposure, UsbIpPort& port) const;
    bool send(UsbIpPort& port, std::span<const std::uint8_t> payload) const;
    bool send_frame(UsbIpPort& port, const std::vector<std::uint16_t>& samples, bool damaged);

    const TwinPictures& pictures_;
    const LampView& lamps_;
    Clock& clock_;
    TwinOptions options_;
    TwinOrders& orders_;
    std::uint64_t frames_ = 0;
    TimePoint next_;  ///< when an exposure may begin
};

}  // namespace darkbox::sim
