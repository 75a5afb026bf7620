#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "processing/pipeline/ball_focus.h"
#include "rig/daemon/api.h"
#include "rig/daemon/api_words.h"
#include "rig/daemon/capture_order_json.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr std::size_t usual_page = 100;
constexpr std::size_t largest_page = 1000;

Json need_json(const ApiRequest& request) {
    constexpr std::string_view json = "application/json";
    const std::string_view given = std::string_view(request.content_type).substr(0, request.content_type.find(';'));
    if (given != json) throw Rejected{415, "the body is not application/json", "send Content-Type: application/json"};
    return parse_object(request.body);
}

PageRequest page_of(const std::map<std::string, std::string>& query) {
    PageRequest page{.limit = usual_page};
    if (const auto after = query.find("after"); after != query.end()) page.after = after->second;
    if (const auto limit = query.find("limit"); limit != query.end()) page.limit = number(limit->second, "limit");
    if (page.limit < 1 || page.limit > largest_page)
        throw InputError(fmt::format("limit is {}; allowed: 1 to {}", page.limit, largest_page), "ask page by page");
    return page;
}

/// The words to look for. Each is a condition of its own, so there are not many.
std::string find_of(const std::map<std::string, std::string>& query) {
    constexpr std::size_t longest = 200;  // bytes
    const auto find = query.find("find");
    if (find == query.end()) return "";
    if (find->second.size() > longest)
        throw InputError(fmt::format("find has {} bytes; allowed: up to {}", find->second.size(), longest),
                         "look for fewer words");
    return find->second;
}

/// One more than the page is asked for, to see whether it goes on.
template <typename Items, typename Key>
void end_page(Json& json, Items& items, std::size_t limit, Key key) {
    if (items.size() <= limit) return;
    items.resize(limit);
    json["next"] = key(items.back());
}

std::uint64_t id_of(const std::map<std::string, std::string>& parts) { return number(parts.at("id"), "the job's id"); }

}  // namespace

ApiResponse Api::status(const Call&) const {
    const ServiceStatus status = service_.status();
    Json json{{"state", name(status.state)},
              {"version", DARKBOX_VERSION},
              {"rig", rig_.name},
              {"camera", {{"driver", rig_.camera.driver}, {"device", rig_.camera.device}}},
              {"lamps", {{"driver", rig_.lamps_driver}, {"count", rig_.lamps.size()}}},
              {"sessions", fs::absolute(service_.sessions()).string()},
              {"queued", status.queued},
              {"processing", status.processing},
              {"last_event", status.last_event}};
    json["lamps"]["reachable"] = status.lamps.reachable;
    json["lamps"]["problems"] = status.lamps.problems;
    if (status.lamps.temperature_c) json["lamps"]["temperature_c"] = *status.lamps.temperature_c;
    if (!status.problem.empty()) json["problem"] = status.problem;
    if (status.running) json["running"] = to_json(*status.running);
    return reply(json);
}

ApiResponse Api::lamps(const Call&) const {
    Json list = Json::array();
    for (const LampDescription& lamp : rig_.lamps)
        list.push_back({{"name", lamp.name}, {"position_mm", lamp.position_mm}});
    return reply({{"driver", rig_.lamps_driver}, {"lamps", list}});
}

ApiResponse Api::darken(const Call&) const { return reply({{"event", service_.darken()}}, 202); }

ApiResponse Api::events(const Call& call) const {
    ApiResponse response;
    response.content_type = "application/x-ndjson";
    const auto after = call.query.find("after");
    response.stream_events = after == call.query.end() ? 0 : number(after->second, "after");
    return response;
}

ApiResponse Api::start_capture(const Call& call) const {
    const Json body = need_json(call.request);
    if (body.contains("process"))
        throw InputError("unknown key \"process\"", "known: object, inventory, dublin_core, lamps, mode, name, resume");
    return reply(to_json(service_.start_capture(capture_order_from(body))), 202);
}

ApiResponse Api::jobs(const Call& call) const {
    PageRequest page = page_of(call.query);
    if (!page.after.empty()) (void)number(page.after, "after");
    const std::size_t limit = page.limit++;
    auto jobs = service_.jobs(page);
    Json json{{"jobs", Json::array()}};
    end_page(json, jobs, limit, [](const Job& job) { return std::to_string(job.id); });
    for (const Job& job : jobs) json["jobs"].push_back(to_json(job));
    return reply(json);
}

ApiResponse Api::enqueue(const Call& call) const {
    return reply(to_json(service_.enqueue(job_from(need_json(call.request)))), 202);
}

ApiResponse Api::job(const Call& call) const { return reply(to_json(service_.job(id_of(call.parts)))); }

ApiResponse Api::cancel(const Call& call) const { return reply(to_json(service_.cancel(id_of(call.parts))), 202); }

ApiResponse Api::job_log(const Call& call) const {
    const Job job = service_.job(id_of(call.parts));
    const fs::path file = service_.job_log(job.id);
    auto open = open_beneath(file.parent_path(), file.filename().string());
    if (open) return answer_with_file(std::move(*open), "text/plain; charset=utf-8", call.request);
    ApiResponse empty;
    empty.content_type = "text/plain; charset=utf-8";
    return empty;
}

Json Api::describe(const SessionListing& session, const ServiceStatus& status) const {
    const bool capturing = status.running && status.running->session == session.name;
    Json json{{"name", session.name},
              {"state", capturing ? "capturing" : darkbox::name(session.state)},
              {"frames", session.frames}};
    if (!session.object.empty()) json["object"] = session.object;
    if (!session.record.inventory.empty()) json["inventory"] = session.record.inventory;
    if (!session.record.dublin_core.empty()) json["dublin_core"] = session.record.dublin_core;
    if (!session.created.empty()) json["created"] = session.created;
    if (!session.problem.empty()) json["problem"] = session.problem;
    if (!session.retakes.empty()) json["retakes"] = session.retakes;
    return json;
}

ApiResponse Api::sessions(const Call& call) const {
    PageRequest page = page_of(call.query);
    const std::size_t limit = page.limit++;
    const ServiceStatus status = service_.status();
    service_.catalog().refresh_if_changed();
    const std::string find = find_of(call.query);
    auto sessions = service_.catalog().sessions(page, find);
    Json json{{"folder", fs::absolute(service_.sessions()).string()},
              {"total", service_.catalog().session_count(find)},
              {"sessions", Json::array()}};
    end_page(json, sessions, limit, [](const SessionListing& session) { return session.name; });
    for (const SessionListing& session : sessions) json["sessions"].push_back(describe(session, status));
    return reply(json);
}

ApiResponse Api::session(const Call& call) const {
    const std::string& name = call.parts.at("name");
    Catalog& catalog = service_.catalog();
    catalog.refresh(name);
    const auto session = catalog.session(name);
    if (!session) throw NotFound(fmt::format("there is no session \"{}\"", name), "GET sessions lists them");
    Json json = describe(*session, service_.status());
    json["frame_list"] = Json::array();
    for (const CatalogFrame& frame : catalog.frames(name)) json["frame_list"].push_back(to_json(frame));
    json["drift"] = Json::array();
    for (const CatalogDrift& drift : catalog.drifts(name)) json["drift"].push_back(to_json(drift));
    return reply(json);
}

ApiResponse Api::files(const Call& call) const {
    const std::string& name = call.parts.at("name");
    const fs::path folder = session_path(service_.sessions(), name);
    if (!describe_session(folder) || fs::is_symlink(folder))
        throw NotFound(fmt::format("there is no session \"{}\"", name), "GET sessions lists them");
    Json list = Json::array();
    for (const std::string& file : files_below(folder)) {
        std::error_code error;
        const auto status = fs::symlink_status(folder / file, error);
        if (error || status.type() != fs::file_type::regular) continue;  // links lead nowhere from here
        const auto size = fs::file_size(folder / file, error);
        if (!error) list.push_back({{"path", file}, {"bytes", size}, {"type", content_type_of(file)}});
    }
    return reply({{"session", name}, {"files", list}});
}

ApiResponse Api::file(const Call& call) const {
    const std::string& name = call.parts.at("name");
    (void)session_path(service_.sessions(), name);
    const std::string& path = call.parts.at("path");
    // The kernel keeps the way inside the sessions' folder; this keeps it inside the session.
    std::optional<OpenFile> file;
    if (("/" + path + "/").find("/../") == std::string::npos)
        file = open_beneath(service_.sessions(), name + "/" + path);
    if (!file) throw NotFound(fmt::format("session \"{}\" has no such file", name), "GET its files lists them");
    return answer_with_file(std::move(*file), content_type_of(path), call.request);
}

ApiResponse Api::calibrations(const Call& call) const {
    PageRequest page = page_of(call.query);
    const std::size_t limit = page.limit++;
    Catalog& catalog = service_.catalog();
    catalog.refresh();
    auto calibrations = catalog.calibrations(page);
    Json json{{"calibrations", Json::array()}};
    end_page(json, calibrations, limit, [](const CatalogCalibration& c) { return c.session; });
    for (const CatalogCalibration& calibration : calibrations) {
        Json entry = to_json(calibration);
        if (const auto blur = stored_blur_px(service_.sessions() / calibration.session)) entry["blur_px"] = *blur;
        entry["drift"] = Json::array();
        for (const CatalogDrift& drift : catalog.drifts(calibration.session)) entry["drift"].push_back(to_json(drift));
        json["calibrations"].push_back(std::move(entry));
    }
    return reply(json);
}

ApiResponse Api::rebuild(const Call&) const {
    service_.catalog().rebuild();
    return reply({{"sessions", service_.catalog().session_count()}});
}

ApiResponse Api::preview(const Call& call) const {
    const ServiceStatus status = service_.status();
    if (!status.running || status.running->session.empty())
        throw Rejected{404, "no capture runs, so there is nothing to see", "start one"};
    const fs::path folder = session_path(service_.sessions(), status.running->session);
    std::optional<LatestFrame> frame;
    if (fs::exists(folder)) frame = preview_.latest(folder);
    if (!frame) throw Rejected{404, "no frame was taken yet", "ask again in a moment"};
    ApiResponse response;
    response.content_type = "image/jpeg";
    response.headers = {{"ETag", fmt::format("\"{}\"", frame->file)}, {"X-Darkbox-Lamp", frame->lamp}};
    if (call.request.if_none_match == response.headers.front().second) {
        response.status = 304;
        return response;
    }
    response.body = std::move(frame->bytes);
    return response;
}

ApiResponse Api::openapi(const Call&) const {
    ApiResponse response;
    response.body = openapi_document();
    return response;
}

}  // namespace darkbox
