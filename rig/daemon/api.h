#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rig/daemon/service.h"

namespace darkbox {

struct ApiRequest {
    std::string method = {};        ///< "GET"
    std::string target = {};        ///< "/api/v1/status?…"
    std::string content_type = {};  ///< empty when none was given
    std::string body = {};
};

struct ApiResponse {
    int status = 200;
    std::string content_type = "application/json";
    std::string body = {};
    std::string allow = {};                           ///< the methods that would do, with status 405
    std::optional<std::uint64_t> stream_events = {};  ///< instead of a body: events after this number, as they come
};

/// What /api/v1 answers:
///   GET    status           state, rig, version, the running capture
///   POST   captures         {"object"?, "lamps"?: [name…], "name"?} or {"resume": session} → 202 and the job
///   GET    captures/ID      the job
///   DELETE captures/ID      asks it to stop → 202
///   GET    sessions         what lies in the sessions' folder
///   GET    lamps            names, and where they are
///   POST   lamps/dark       → 202; the event "lamps" tells how it went
///   GET    events?after=N   one JSON object a line, as it happens; a blank line is a heartbeat
/// Errors are application/problem+json (RFC 7807): type, title, status, detail, hint.
/// Never throws; no request is harmful. Thread-safe.
class Api {
public:
    Api(const RigDescription& rig, Service& service) : rig_(rig), service_(service) {}

    ApiResponse answer(const ApiRequest& request) const noexcept;

private:
    ApiResponse route(const ApiRequest& request) const;
    ApiResponse status() const;
    ApiResponse sessions() const;
    ApiResponse lamps() const;
    ApiResponse start_capture(const ApiRequest& request) const;
    ApiResponse darken() const;

    const RigDescription& rig_;
    Service& service_;
};

/// application/problem+json of this HTTP status.
ApiResponse problem(int status, const std::string& detail, const std::string& hint);

}  // namespace darkbox
