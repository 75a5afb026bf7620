#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rig/daemon/metrics.h"
#include "rig/daemon/open_beneath.h"
#include "rig/daemon/preview.h"
#include "rig/daemon/service.h"

namespace darkbox {

struct ApiRequest {
    std::string method = {};        ///< "GET"
    std::string target = {};        ///< "/api/v1/status?…"
    std::string content_type = {};  ///< empty when none was given; so are the next three
    std::string range = {};
    std::string if_range = {};
    std::string if_none_match = {};
    std::string body = {};
};

/// Some bytes of an open file, instead of a body.
struct FileSlice {
    UniqueFd fd;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
};

struct ApiResponse {
    int status = 200;
    std::string content_type = "application/json";
    std::string body = {};
    std::string allow = {};                           ///< the methods that would do, with status 405
    std::optional<std::uint64_t> stream_events = {};  ///< instead of a body: events after this number, as they come
    std::optional<FileSlice> file = {};
    std::vector<std::pair<std::string, std::string>> headers = {};  ///< further ones
};

/// What the daemon answers under /api/v1, and at /metrics. The addresses, and all that goes in and comes out, are in
/// openapi.json, which GET /api/v1/openapi.json serves and tests hold true.
/// Errors are application/problem+json (RFC 9457): type, title, status, detail, hint.
/// Never throws; no request is harmful. Thread-safe.
class Api {
public:
    Api(const RigDescription& rig, Service& service, Metrics& metrics);

    ApiResponse answer(const ApiRequest& request) const noexcept;

    /// "GET status", as openapi.json has them; for the test that compares.
    std::vector<std::string> routes() const;

private:
    /// The request, its address taken apart.
    struct Call {
        const ApiRequest& request;
        std::map<std::string, std::string> parts;  ///< of the address: what stands for {name}
        std::map<std::string, std::string> query;
    };
    using Handler = ApiResponse (Api::*)(const Call&) const;
    struct Route {
        std::string_view method;
        std::string_view address;  ///< below /api/v1/; a last part {path} takes slashes
        std::vector<std::string_view> query;
        Handler handler;
    };
    static const std::vector<Route>& table();

    ApiResponse route(const ApiRequest& request) const;
    ApiResponse status(const Call& call) const;
    ApiResponse lamps(const Call& call) const;
    ApiResponse dose(const Call& call) const;
    ApiResponse darken(const Call& call) const;
    ApiResponse events(const Call& call) const;
    ApiResponse start_capture(const Call& call) const;
    ApiResponse jobs(const Call& call) const;
    ApiResponse enqueue(const Call& call) const;
    ApiResponse job(const Call& call) const;
    ApiResponse cancel(const Call& call) const;
    ApiResponse job_log(const Call& call) const;
    ApiResponse sessions(const Call& call) const;
    ApiResponse session(const Call& call) const;
    ApiResponse files(const Call& call) const;
    ApiResponse file(const Call& call) const;
    ApiResponse calibrations(const Call& call) const;
    ApiResponse rebuild(const Call& call) const;
    ApiResponse preview(const Call& call) const;
    ApiResponse openapi(const Call& call) const;

    nlohmann::json describe(const SessionListing& session, const ServiceStatus& status) const;

    const RigDescription& rig_;
    Service& service_;
    Metrics& metrics_;
    mutable Preview preview_;
};

/// application/problem+json of this HTTP status.
ApiResponse problem(int status, const std::string& detail, const std::string& hint);

/// The document of the API: OpenAPI 3.1, JSON.
std::string_view openapi_document();

}  // namespace darkbox
