#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "rig/daemon/events.h"
#include "rig/daemon/service.h"

namespace darkbox {

/// What the daemon counts, in the text form that Prometheus reads (version 0.0.4). Thread-safe.
class Metrics {
public:
    void count_request(int status) { ++requests_.at(static_cast<std::size_t>(status / 100 % requests_.size())); }
    void connection_opened() { ++connections_; }
    void connection_closed() { --connections_; }
    void listener_joined() { ++listeners_; }
    void listener_left() { --listeners_; }
    void refused() { ++refused_; }
    /// Of the TLS certificate in use.
    void certificate_expires(std::chrono::system_clock::time_point when) {
        certificate_expires_ = std::chrono::duration_cast<std::chrono::seconds>(when.time_since_epoch()).count();
    }

    std::string text(Service& service) const;

private:
    std::array<std::atomic<std::uint64_t>, 6> requests_{};  ///< by the status' first digit
    std::atomic<std::int64_t> connections_{0};
    std::atomic<std::int64_t> listeners_{0};
    std::atomic<std::uint64_t> refused_{0};
    std::atomic<std::int64_t> certificate_expires_{0};  ///< seconds since 1970; 0: there is none
};

}  // namespace darkbox
