#include "rig/daemon/api.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <initializer_list>
#include <string_view>

#include "acquisition/frame/error.h"
#include "rig/daemon/capture_order_json.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

constexpr std::string_view prefix = "/api/v1/";

/// The request does not fit the API: an HTTP status other than 400.
struct Rejected {
    int status;
    std::string detail;
    std::string hint;
    std::string allow = {};
};

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

ApiResponse reply(const Json& json, int status = 200) { return {.status = status, .body = dump(json) + "\n"}; }

std::string_view title(int status) {
    switch (status) {
        case 400:
            return "Bad Request";
        case 404:
            return "Not Found";
        case 405:
            return "Method Not Allowed";
        case 409:
            return "Conflict";
        case 413:
            return "Payload Too Large";
        case 415:
            return "Unsupported Media Type";
        case 431:
            return "Request Header Fields Too Large";
        case 503:
            return "Service Unavailable";
        default:
            return "Internal Server Error";
    }
}

void need_method(const ApiRequest& request, std::initializer_list<std::string_view> allowed) {
    for (const std::string_view method : allowed)
        if (request.method == method) return;
    const std::string list = fmt::format("{}", fmt::join(allowed, ", "));
    throw Rejected{405, fmt::format("{} is not what this address takes", request.method.substr(0, 20)), "use " + list,
                   list};
}

void need_json(const ApiRequest& request) {
    const std::string type = request.content_type.substr(0, request.content_type.find(';'));
    if (type != "application/json")
        throw Rejected{415, "the body is not application/json", "send Content-Type: application/json"};
}

std::uint64_t number(std::string_view text, const std::string& what) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
        throw InputError(fmt::format("{} is not a number", what), "use digits only");
    return value;
}

/// Of "after=12"; 0 without a query.
std::uint64_t events_after(std::string_view query) {
    constexpr std::string_view key = "after=";
    if (query.empty()) return 0;
    if (!query.starts_with(key)) throw InputError("unknown query", "known: after=NUMBER");
    return number(query.substr(key.size()), "after");
}

[[noreturn]] void no_such_address() {
    throw Rejected{404, "there is nothing at this address", "see GET /api/v1/status"};
}

Json describe(const SessionListing& session) {
    Json json{{"name", session.name}, {"state", name(session.state)}, {"frames", session.frames}};
    if (!session.object.empty()) json["object"] = session.object;
    if (!session.created.empty()) json["created"] = session.created;
    if (!session.problem.empty()) json["problem"] = session.problem;
    return json;
}

}  // namespace

ApiResponse problem(int status, const std::string& detail, const std::string& hint) {
    return {.status = status,
            .content_type = "application/problem+json",
            .body = dump({{"type", "about:blank"},
                          {"title", title(status)},
                          {"status", status},
                          {"detail", detail},
                          {"hint", hint}}) +
                    "\n"};
}

ApiResponse Api::answer(const ApiRequest& request) const noexcept {
    try {
        return route(request);
    } catch (const Rejected& rejected) {
        ApiResponse response = problem(rejected.status, rejected.detail, rejected.hint);
        response.allow = rejected.allow;
        return response;
    } catch (const NotFound& error) {
        return problem(404, error.what(), error.hint());
    } catch (const Refused& error) {
        return problem(409, error.what(), error.hint());
    } catch (const InputError& error) {
        return problem(400, error.what(), error.hint());
    } catch (const Error& error) {
        return problem(500, error.what(), error.hint());
    } catch (const std::exception& error) {
        return problem(500, error.what(), "this is a defect of darkbox; please report it");
    }
}

ApiResponse Api::route(const ApiRequest& request) const {
    std::string_view path = request.target;
    if (!path.starts_with(prefix)) no_such_address();
    path.remove_prefix(prefix.size());
    const auto question = path.find('?');
    const std::string_view query = question == path.npos ? "" : path.substr(question + 1);
    path = path.substr(0, question);

    if (path == "events") {
        need_method(request, {"GET"});
        return {.content_type = "application/x-ndjson", .stream_events = events_after(query)};
    }
    if (!query.empty()) throw InputError("this address takes no query", "leave out what follows the question mark");
    if (path == "status") return need_method(request, {"GET"}), status();
    if (path == "sessions") return need_method(request, {"GET"}), sessions();
    if (path == "lamps") return need_method(request, {"GET"}), lamps();
    if (path == "lamps/dark") return need_method(request, {"POST"}), darken();
    if (path == "captures") return need_method(request, {"POST"}), start_capture(request);
    constexpr std::string_view one_capture = "captures/";
    if (!path.starts_with(one_capture)) no_such_address();
    const std::uint64_t id = number(path.substr(one_capture.size()), "the capture's id");
    need_method(request, {"GET", "DELETE"});
    return request.method == "GET" ? reply(to_json(service_.job(id))) : reply(to_json(service_.cancel(id)), 202);
}

ApiResponse Api::status() const {
    const ServiceStatus status = service_.status();
    Json json{{"state", name(status.state)},
              {"version", DARKBOX_VERSION},
              {"rig", rig_.name},
              {"camera", {{"driver", rig_.camera.driver}, {"device", rig_.camera.device}}},
              {"lamps", {{"driver", rig_.lamps_driver}, {"count", rig_.lamps.size()}}},
              {"sessions", std::filesystem::absolute(service_.sessions()).string()},
              {"last_event", status.last_event}};
    if (!status.problem.empty()) json["problem"] = status.problem;
    if (status.running) json["running"] = to_json(*status.running);
    return reply(json);
}

ApiResponse Api::sessions() const {
    Json list = Json::array();
    const ServiceStatus status = service_.status();
    for (const SessionListing& session : list_sessions(service_.sessions())) {
        Json json = describe(session);
        if (status.running && status.running->session == session.name) json["state"] = "capturing";
        list.push_back(std::move(json));
    }
    return reply({{"folder", std::filesystem::absolute(service_.sessions()).string()}, {"sessions", list}});
}

ApiResponse Api::lamps() const {
    Json list = Json::array();
    for (const LampDescription& lamp : rig_.lamps)
        list.push_back({{"name", lamp.name}, {"position_mm", lamp.position_mm}});
    return reply({{"driver", rig_.lamps_driver}, {"lamps", list}});
}

ApiResponse Api::start_capture(const ApiRequest& request) const {
    need_json(request);
    return reply(to_json(service_.start_capture(parse_capture_order(request.body))), 202);
}

ApiResponse Api::darken() const { return reply({{"event", service_.darken()}}, 202); }

}  // namespace darkbox
