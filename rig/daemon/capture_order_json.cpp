#include "rig/daemon/capture_order_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

constexpr std::size_t longest_text = 200;  ///< bytes
constexpr std::size_t most_lamps = 1024;
constexpr const char* known_kinds = "known: capture, recalibrate, calibrate, process, export, prune";

std::string text(const Json& value, const std::string& key) {
    if (!value.is_string()) throw InputError(fmt::format("\"{}\" is not a string", key), "put it in quotes");
    auto text = value.get<std::string>();
    if (text.size() > longest_text)
        throw InputError(fmt::format("\"{}\" has {} bytes; allowed: up to {}", key, text.size(), longest_text),
                         "choose a shorter one");
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
    if (std::ranges::any_of(text, is_control))
        throw InputError(fmt::format("\"{}\" holds a control character", key), "use printable characters");
    return text;
}

ExposureChoice exposure(const Json& value) {
    constexpr double shortest_us = 1, longest_us = 60e6;
    if (value.is_number() && value.get<double>() >= shortest_us && value.get<double>() <= longest_us)
        return {Seconds(value.get<double>() / 1e6)};
    if (value == "auto") return {std::nullopt};
    throw InputError(fmt::format("\"exposure\" is {}",
                                 value.dump(-1, ' ', true, Json::error_handler_t::replace).substr(0, longest_text)),
                     R"(write "auto", or microseconds: 1 to 60000000)");
}

FrameKind plan(const Json& value) {
    const std::string plan = text(value, "plan");
    if (plan == "lit") return FrameKind::lit;
    if (plan == "flat") return FrameKind::flat;
    throw InputError(fmt::format("unknown plan \"{}\"", plan), "known: lit, flat");
}

std::vector<std::string> texts(const Json& value, const std::string& key) {
    if (!value.is_array() || value.size() > most_lamps)
        throw InputError(fmt::format("\"{}\" is not a list of up to {} names", key, most_lamps),
                         R"(write ["lamp-01", "lamp-02"])");
    std::vector<std::string> result;
    for (const Json& item : value) result.push_back(text(item, key));
    return result;
}

/// {"title": "A vase", "creator": ["A", "B"]}
void add_dublin_core(const Json& value, ObjectRecord& record) {
    const std::string where = "\"dublin_core\"";
    if (!value.is_object()) throw InputError(where + " is not an object", R"(write {"title": "A vase"})");
    for (const auto& [element, values] : value.items()) {
        for (const Json& one : values.is_array() ? values : Json::array({values})) {
            if (!one.is_string())
                throw InputError(where + " holds something that is neither a string nor a list of them",
                                 R"(write {"creator": ["A", "B"]})");
            add_value(where, record, element, one.get<std::string>());
        }
    }
    require_valid(where, record);
}

}  // namespace

Json parse_object(const std::string& body) {
    Json json = Json::parse(body, nullptr, /*allow_exceptions=*/false);
    if (json.is_discarded()) throw InputError("the request's body is not JSON", "send one JSON object");
    if (!json.is_object()) throw InputError("the request's body is not a JSON object", "send one JSON object");
    return json;
}

CaptureOrder capture_order_from(const Json& json) {
    CaptureOrder order;
    for (const auto& [key, value] : json.items()) {
        if (key == "object") {
            order.object = text(value, key);
        } else if (key == "name") {
            order.name = text(value, key);
        } else if (key == "resume") {
            order.resume = text(value, key);
        } else if (key == "retake") {
            order.retake = text(value, key);
        } else if (key == "plan") {
            order.kind = plan(value);
        } else if (key == "flats_from") {
            order.flats_from = text(value, key);
        } else if (key == "exposure") {
            order.exposure = exposure(value);
        } else if (key == "lamps") {
            order.lamps = texts(value, key);
        } else if (key == "inventory") {
            order.record.inventory = text(value, key);
        } else if (key == "dublin_core") {
            add_dublin_core(value, order.record);
        } else if (key == "mode") {
            order.mode = sync_mode_from_name(text(value, key));
            if (!order.mode)
                throw InputError(fmt::format("unknown mode \"{}\"", text(value, key)),
                                 "known: settled, predictive, strobed");
        } else if (key != "process") {  // what is to follow is the queue's concern
            throw InputError(
                fmt::format("unknown key \"{}\"", key.substr(0, longest_text)),
                "known: object, inventory, dublin_core, lamps, mode, exposure, plan, flats_from, name, retake, "
                "resume");
        }
    }
    return order;
}

HandLight hand_light_from(const Json& body, const RigDescription& rig) {
    std::string lamp, object;
    std::optional<Seconds> time;
    for (const auto& [key, value] : body.items()) {
        if (key == "lamp") {
            lamp = text(value, key);
        } else if (key == "object") {
            object = text(value, key);
        } else if (key == "seconds") {
            if (!value.is_number()) throw InputError("\"seconds\" is not a number", "write 1.5");
            time = Seconds(value.get<double>());
        } else {
            throw InputError(fmt::format("unknown key \"{}\"", key.substr(0, longest_text)),
                             "known: lamp, seconds, object");
        }
    }
    return light_by_hand(rig, lamp, time, object);
}

Job job_from(const Json& body) {
    Job job;
    job.orders = body;
    const auto kind = body.find("kind");
    if (kind == body.end()) throw InputError("the job has no \"kind\"", known_kinds);
    const auto known = job_kind_from_name(text(*kind, "kind"));
    if (!known) throw InputError(fmt::format("unknown kind \"{}\"", kind->get<std::string>()), known_kinds);
    job.kind = *known;
    job.orders.erase("kind");
    if (lane_of(job.kind) == Lane::rig) {
        if (const auto process = body.find("process"); process != body.end() && !process->is_boolean())
            throw InputError("\"process\" is not true or false", "leave it out, or write true");
        (void)capture_order_from(job.orders);
        return job;
    }
    if (job.kind == JobKind::prune) {
        for (const auto& [key, value] : job.orders.items())
            if (key != "dry_run" || !value.is_boolean())
                throw InputError(fmt::format("unknown key \"{}\"", key.substr(0, longest_text)),
                                 "known: kind, and dry_run: true or false");
        return job;
    }
    for (const auto& [key, value] : job.orders.items()) {
        if (key == "session") {
            job.session = text(value, key);
        } else if (key == "format" && job.kind == JobKind::export_map) {
            if (!export_target(text(value, key)))
                throw InputError("unknown \"format\"", "known: lp, diligent, ptm, ptm-rgb, relight, ply");
        } else {
            throw InputError(fmt::format("unknown key \"{}\"", key.substr(0, longest_text)),
                             "known: kind, session, and format for an export");
        }
    }
    if (job.session.empty()) throw InputError("the job has no \"session\"", "name a sealed session");
    if (job.kind == JobKind::export_map && !job.orders.contains("format"))
        throw InputError("an export needs a \"format\"", "known: lp, diligent, ptm, ptm-rgb, relight, ply");
    return job;
}

std::optional<std::string> export_target(const std::string& format) {
    if (format == "lp") return "lights.lp";
    if (format == "ply") return "surface.ply";
    if (format == "ptm" || format == "ptm-rgb") return format + ".ptm";
    if (format == "diligent" || format == "relight") return format;
    return std::nullopt;
}

Json to_json(const CaptureOrder& order) {
    Json json = Json::object();
    if (!order.object.empty()) json["object"] = order.object;
    if (!order.name.empty()) json["name"] = order.name;
    if (!order.lamps.empty()) json["lamps"] = order.lamps;
    if (!order.record.inventory.empty()) json["inventory"] = order.record.inventory;
    if (!order.record.dublin_core.empty()) json["dublin_core"] = order.record.dublin_core;
    if (order.mode) json["mode"] = name(*order.mode);
    if (order.exposure) {
        const auto& fixed = order.exposure->fixed;
        json["exposure"] = fixed ? Json(fixed->count() * 1e6) : Json("auto");
    }
    if (order.kind != FrameKind::lit) json["plan"] = name(order.kind);
    if (order.flats_from) json["flats_from"] = *order.flats_from;
    if (order.retake) json["retake"] = *order.retake;
    if (order.resume) json["resume"] = *order.resume;
    return json;
}

}  // namespace darkbox
