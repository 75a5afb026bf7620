#include "sim/bridge/twin_camera.h"

#include <algorithm>

namespace darkbox::sim {
namespace {

using std::chrono::milliseconds;

constexpr auto look_at_lamps_every = milliseconds(2);
constexpr auto idle = milliseconds(50);
/// A host that takes nothing for so long has stopped the stream.
constexpr auto host_patience = milliseconds(500);
/// What automatic exposure comes to: a picture that no capture can take for the one it asked for.
constexpr Seconds automatic_exposure{0.002};

}  // namespace

TwinCamera::TwinCamera(const TwinPictures& pictures, const LampView& lamps, Clock& clock, const TwinOptions& options,
                       TwinOrders& orders)
    : pictures_(pictures), lamps_(lamps), clock_(clock), options_(options), orders_(orders) {}

void TwinCamera::run() {
    while (!orders_.leave) {
        stay_plugged_in();
        const TimePoint back = clock_.now() + to_nanoseconds(options_.unplugged);
        while (!orders_.leave && clock_.now() < back) clock_.sleep_for(idle);
    }
}

/// A camera that was unplugged forgets its settings: every time a new one.
void TwinCamera::stay_plugged_in() {
    UvcCamera camera(options_.mode, "TWIN0001");
    UsbIpPort port(camera, clock_, options_.port);
    while (!orders_.leave && !orders_.unplug.exchange(false) && !port.host_is_gone()) {
        port.serve_until_waiting(UvcCamera::stream_endpoint, clock_.now() + idle);
        if (!port.is_waiting(UvcCamera::stream_endpoint)) continue;
        wait_for_its_turn(port);
        if (port.is_waiting(UvcCamera::stream_endpoint)) frame(camera, port);
    }
}

/// Late, it waits for the next turn: a free-running camera leaves frames out, and keeps its rhythm.
void TwinCamera::wait_for_its_turn(UsbIpPort& port) {
    const Nanoseconds period = to_nanoseconds(options_.mode.period);
    const TimePoint now = clock_.now();
    if (next_ < now) next_ += (now - next_ + period - Nanoseconds(1)) / period * period;
    port.serve(next_);
    next_ += period;
}

/// The first payload of a frame leaves when its exposure ends, as a sensor's readout begins: it is then that the kernel
/// stamps the frame.
void TwinCamera::frame(UvcCamera& camera, UsbIpPort& port) {
    const Seconds exposure = camera.is_automatic() ? automatic_exposure : camera.exposure();
    const std::vector<double> shares = watch_lamps(exposure, port);
    const bool damaged = orders_.damage_next.exchange(false);
    const UvcCamera::PayloadHeader begin{.odd_frame = frames_ % 2 == 1, .last = false, .error = damaged};
    if (!send(port, UvcCamera::bytes(begin))) return;
    send_frame(port, pictures_.expose(options_.sensor, shares, {exposure.count(), camera.gain(), frames_}), damaged);
    ++frames_;
}

/// Each lamp's share of the exposure, found by looking again and again.
std::vector<double> TwinCamera::watch_lamps(Seconds exposure, UsbIpPort& port) const {
    std::vector<double> shares(pictures_.lamps(), 0.0);
    const TimePoint end = clock_.now() + to_nanoseconds(exposure);
    double looks = 0;
    if (options_.strobe != nullptr) options_.strobe->drive(true);
    do {
        const std::vector<double> burning = lamps_.burning();
        for (std::size_t i = 0; i < shares.size(); ++i) shares[i] += burning[i];
        ++looks;
        port.serve(std::min(end, clock_.now() + look_at_lamps_every));
    } while (clock_.now() < end);
    if (options_.strobe != nullptr) options_.strobe->drive(false);
    for (double& share : shares) share /= looks;
    return shares;
}

bool TwinCamera::send(UsbIpPort& port, std::span<const std::uint8_t> payload) const {
    port.serve_until_waiting(UvcCamera::stream_endpoint, clock_.now() + host_patience);
    if (!port.is_waiting(UvcCamera::stream_endpoint)) return false;
    port.complete(UvcCamera::stream_endpoint, payload);
    return true;
}

bool TwinCamera::send_frame(UsbIpPort& port, const std::vector<std::uint16_t>& samples, bool damaged) {
    UsbBytes bytes;
    bytes.reserve(2 * samples.size());
    for (const std::uint16_t sample : samples)
        bytes.insert(bytes.end(), {static_cast<std::uint8_t>(sample & 255U), static_cast<std::uint8_t>(sample >> 8U)});
    constexpr std::size_t header_size = 2;
    for (std::size_t sent = 0; sent < bytes.size();) {
        const std::size_t part = std::min(bytes.size() - sent, UvcCamera::largest_payload - header_size);
        const auto header =
            UvcCamera::bytes({.odd_frame = frames_ % 2 == 1, .last = sent + part == bytes.size(), .error = damaged});
        UsbBytes payload(header.begin(), header.end());
        const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(sent);
        payload.insert(payload.end(), first, first + static_cast<std::ptrdiff_t>(part));
        if (orders_.unplug || !send(port, payload)) return false;
        sent += part;
    }
    return true;
}

}  // namespace darkbox::sim
