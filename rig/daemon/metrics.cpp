#include "rig/daemon/metrics.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "rig/capture/dose_book.h"
#include "rig/daemon/attempt.h"

namespace darkbox {
namespace {

constexpr std::array service_states{ServiceState::offline, ServiceState::idle, ServiceState::busy, ServiceState::fault};

std::string head(const char* metric, const char* type, const char* help) {
    return fmt::format("# HELP {0} {2}\n# TYPE {0} {1}\n", metric, type, help);
}

template <typename Value>
std::string one(const char* metric, const char* type, const char* help, Value value) {
    return head(metric, type, help) + fmt::format("{} {}\n", metric, value);
}

/// Bytes of memory that are this process's own and in use.
std::uint64_t resident_bytes() {
    std::ifstream statm("/proc/self/statm");
    std::uint64_t size = 0;
    std::uint64_t resident = 0;
    statm >> size >> resident;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Nothing where the book cannot be read: a capture says why.
std::string light_doses(const std::filesystem::path& sessions) {
    double all = 0, most = 0;
    const auto failure = attempt([&] {
        const DoseBook book(sessions);
        for (const auto& [object, dose] : book.objects()) {
            all += dose.lux_s;
            most = std::max(most, dose.lux_s);
        }
    });
    if (failure) return "";
    return one("darkbox_light_dose_lux_seconds", "gauge", "Light that all objects together have had", all) +
           one("darkbox_light_dose_largest_lux_seconds", "gauge", "Light of the object that has had most", most);
}

}  // namespace

std::string Metrics::text(Service& service) const {
    const ServiceStatus status = service.status();
    const JobCounts jobs = service.job_counts();
    std::error_code ignored;
    const auto space = std::filesystem::space(service.sessions(), ignored);

    std::string text = head("darkbox_state", "gauge", "1 for the state that the daemon is in");
    for (const ServiceState state : service_states)
        text += fmt::format("darkbox_state{{state=\"{}\"}} {}\n", name(state), state == status.state ? 1 : 0);
    text += head("darkbox_jobs_total", "counter", "Jobs that ended since the daemon started");
    for (const auto& [key, count] : jobs)
        text += fmt::format("darkbox_jobs_total{{kind=\"{}\",state=\"{}\"}} {}\n", name(key.first), name(key.second),
                            count);
    text += one("darkbox_lamps_reachable", "gauge", "1 while the lamps answer", status.lamps.reachable ? 1 : 0);
    if (status.lamps.temperature_c)
        text +=
            one("darkbox_lamps_temperature_celsius", "gauge", "Of the lamps' heat sink", *status.lamps.temperature_c);
    text += one("darkbox_captures_queued", "gauge", "Captures that wait for the rig", status.queued);
    text += one("darkbox_processing_jobs", "gauge", "Processing jobs, running or waiting", status.processing);
    text += one("darkbox_frames_total", "counter", "Frames of captures that ended", service.frames_captured());
    text += one("darkbox_exposures_repeated_total", "counter", "Exposures that had to be taken again",
                service.exposures_repeated());
    text += one("darkbox_sessions", "gauge", "Sessions in the catalogue", service.catalog().session_count());
    text += one("darkbox_disk_free_bytes", "gauge", "Free space where the sessions lie", space.available);
    text += light_doses(service.sessions());
    text += one("darkbox_events_total", "counter", "Events told to listeners", status.last_event);
    text += head("darkbox_http_requests_total", "counter", "Requests answered, by the status' first digit");
    for (std::size_t digit = 1; digit < requests_.size(); ++digit)
        text += fmt::format("darkbox_http_requests_total{{status=\"{}xx\"}} {}\n", digit, requests_.at(digit).load());
    text += one("darkbox_http_refused_total", "counter", "Connections and requests turned away at the door",
                refused_.load());
    text += one("darkbox_http_connections", "gauge", "Open connections", connections_.load());
    text += one("darkbox_event_listeners", "gauge", "Connections that listen to events", listeners_.load());
    if (const auto expires = certificate_expires_.load(); expires != 0)
        text += one("darkbox_tls_certificate_expires_seconds", "gauge", "When the certificate in use ends, since 1970",
                    expires);
    text += one("process_resident_memory_bytes", "gauge", "Memory in use", resident_bytes());
    return text;
}

}  // namespace darkbox
