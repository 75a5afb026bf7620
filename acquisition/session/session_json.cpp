#include "acquisition/session/session_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "acquisition/frame/error.h"
#include "acquisition/session/record_checks.h"

namespace darkbox {
namespace {

using Json = nlohmann::ordered_json;  // fields keep the order in which people read them

constexpr int deepest_nesting = 16;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw InputError(where + ": " + what, damaged_hint);
}

Json parse(const std::string& where, std::string_view text) {
    const auto watch_depth = [&](int depth, Json::parse_event_t, Json&) {
        if (depth > deepest_nesting) refuse(where, "nested deeper than any session");
        return true;
    };
    try {
        return Json::parse(text, watch_depth);
    } catch (const Json::exception& error) {
        refuse(where, fmt::format("not valid JSON ({})", error.what()));
    }
}

/// Reads the members of one JSON object, each with its type and range.
class Fields {
public:
    Fields(std::string where, const Json& object) : where_(std::move(where)), object_(object) {
        if (!object.is_object()) refuse(where_, "a JSON object was expected");
    }

    const std::string& where() const { return where_; }
    bool has(const char* key) const { return object_.contains(key); }

    const Json& member(const char* key) const {
        const auto found = object_.find(key);
        if (found == object_.end()) refuse(where_, fmt::format("\"{}\" is missing", key));
        return *found;
    }

    const Json& array(const char* key) const {
        const Json& value = member(key);
        if (!value.is_array()) wrong_type(key, "a list");
        return value;
    }

    std::string text(const char* key) const {
        const Json& value = member(key);
        if (!value.is_string()) wrong_type(key, "a text");
        return value.get<std::string>();
    }

    std::vector<std::string> texts(const char* key) const {
        std::vector<std::string> texts;
        for (const Json& element : array(key)) {
            if (!element.is_string()) wrong_type(key, "a list of texts");
            texts.push_back(element.get<std::string>());
        }
        return texts;
    }

    double number(const char* key) const {
        const Json& value = member(key);
        if (!value.is_number()) wrong_type(key, "a number");
        return value.get<double>();
    }

    template <std::size_t count>
    std::array<double, count> numbers(const char* key) const {
        const Json& value = array(key);
        std::array<double, count> numbers{};
        const bool fits = value.size() == count && std::all_of(value.begin(), value.end(),
                                                               [](const Json& element) { return element.is_number(); });
        if (!fits) wrong_type(key, fmt::format("a list of {} numbers", count));
        std::transform(value.begin(), value.end(), numbers.begin(), [](const Json& e) { return e.get<double>(); });
        return numbers;
    }

    bool flag(const char* key) const {
        const Json& value = member(key);
        if (!value.is_boolean()) wrong_type(key, "true or false");
        return value.get<bool>();
    }

    template <typename Integer>
    Integer integer(const char* key) const {
        const Json& value = member(key);
        if (value.is_number_unsigned()) {
            const auto number = value.get<std::uint64_t>();
            if (std::in_range<Integer>(number)) return static_cast<Integer>(number);
        } else if (value.is_number_integer()) {
            const auto number = value.get<std::int64_t>();
            if (std::in_range<Integer>(number)) return static_cast<Integer>(number);
        }
        wrong_type(key, fmt::format("a whole number from {} to {}", std::numeric_limits<Integer>::min(),
                                    std::numeric_limits<Integer>::max()));
    }

    template <typename Enum>
    Enum named(const char* key, std::optional<Enum> (*from_name)(std::string_view)) const {
        const std::string text_value = text(key);
        const auto value = from_name(text_value);
        if (!value) refuse(where_, fmt::format("\"{}\" is {}, which is none", key, shown(text_value)));
        return *value;
    }

private:
    [[noreturn]] void wrong_type(const char* key, const std::string& expected) const {
        refuse(where_, fmt::format("\"{}\" is not {}", key, expected));
    }

    std::string where_;
    const Json& object_;
};

/// Text that is not UTF-8 is kept readable, with U+FFFD for what is wrong; file names are checked before.
std::string dump(const Json& json, int indent) { return json.dump(indent, ' ', false, Json::error_handler_t::replace); }

/// What is not known is left out.
Json json_of(const CaptureGeometry& geometry) {
    Json json = Json::object();
    if (geometry.mm_per_pixel) json["mm_per_pixel"] = *geometry.mm_per_pixel;
    if (geometry.camera_distance_mm) json["camera_distance_mm"] = *geometry.camera_distance_mm;
    if (geometry.principal_px) json["principal_px"] = *geometry.principal_px;
    if (geometry.ball_diameter_mm) json["ball_diameter_mm"] = *geometry.ball_diameter_mm;
    json["distant_lamps"] = geometry.distant_lamps;
    Json lamps = Json::array();
    for (const NominalLamp& lamp : geometry.lamps)
        lamps.push_back({{"name", lamp.name}, {"position_mm", lamp.position_mm}});
    json["lamps"] = std::move(lamps);
    return json;
}

Json json_of(const SessionReference& reference) {
    return {{"session", reference.name}, {"manifest_sha256", reference.manifest_sha256}};
}

Json json_of(const SessionInfo& info) {
    Json json{{"object", info.object}, {"created", info.created}, {"source", info.source},
              {"rig", info.rig},       {"camera", info.camera},   {"planned_shots", info.planned_shots},
              {"notes", info.notes}};
    if (info.geometry) json["geometry"] = json_of(*info.geometry);
    if (info.retakes) json["retakes"] = json_of(*info.retakes);
    if (info.flats) json["flats"] = json_of(*info.flats);
    if (!info.record.inventory.empty()) json["inventory"] = info.record.inventory;
    if (!info.record.dublin_core.empty()) json["dublin_core"] = info.record.dublin_core;
    return json;
}

Json json_of(const SessionEvent& event) { return {{"when", event.when}, {"what", event.what}}; }

Json json_of(const FrameRecord& record) {
    Json json{{"file", record.file},
              {"kind", name(record.kind)},
              {"format", record.format},
              {"width", record.width},
              {"height", record.height},
              {"bit_depth", record.bit_depth},
              {"black_level", record.black_level},
              {"transfer", name(record.transfer)},
              {"lamp", record.lamp ? Json(record.lamp->value) : Json()},
              {"lamp_name", record.lamp_name},
              {"exposure_s", record.exposure_s},
              {"gain", record.gain},
              {"sequence", record.sequence},
              {"timestamp_ns", record.timestamp_ns},
              {"lamp_on_ns", record.lamp_on_ns},
              {"lamp_off_ns", record.lamp_off_ns},
              {"verified", record.verified},
              {"verification", record.verification},
              {"sha256", record.sha256}};
    if (record.noise) json["noise"] = {{"floor", record.noise->floor}, {"slope", record.noise->slope}};
    if (!record.taken_over_from.empty()) json["taken_over_from"] = record.taken_over_from;
    return json;
}

int known_schema(const Fields& fields) {
    const auto version = fields.integer<int>("schema_version");
    if (version != session_schema)
        throw InputError(
            fmt::format("{}: schema version {}; this darkbox knows {}", fields.where(), version, session_schema),
            "it was written by another version of darkbox; use that one");
    return version;
}

CaptureGeometry geometry_from(const Fields& fields) {
    CaptureGeometry geometry;
    const auto number = [&](const char* key) {
        return fields.has(key) ? std::optional(fields.number(key)) : std::nullopt;
    };
    geometry.mm_per_pixel = number("mm_per_pixel");
    geometry.camera_distance_mm = number("camera_distance_mm");
    geometry.ball_diameter_mm = number("ball_diameter_mm");
    if (fields.has("principal_px")) geometry.principal_px = fields.numbers<2>("principal_px");
    geometry.distant_lamps = fields.flag("distant_lamps");
    for (const Json& lamp : fields.array("lamps")) {
        const Fields one(fields.where(), lamp);
        geometry.lamps.push_back({one.text("name"), one.numbers<3>("position_mm")});
    }
    return geometry;
}

/// Absent in sessions of earlier darkboxes, and where nothing is known.
ObjectRecord object_record_from(const Fields& fields) {
    ObjectRecord record;
    if (fields.has("inventory")) record.inventory = fields.text("inventory");
    if (!fields.has("dublin_core")) return record;
    const Json& elements = fields.member("dublin_core");
    if (!elements.is_object()) refuse(fields.where(), "\"dublin_core\" is not an object");
    for (const auto& [element, values] : elements.items())
        record.dublin_core[element] = Fields(fields.where(), elements).texts(element.c_str());
    return record;
}

std::optional<SessionReference> reference_from(const Fields& fields, const char* key) {
    if (!fields.has(key)) return std::nullopt;
    const Fields reference(fields.where(), fields.member(key));
    return SessionReference{reference.text("session"), reference.text("manifest_sha256")};
}

SessionInfo info_from(const Fields& fields) {
    SessionInfo info;
    info.object = fields.text("object");
    info.created = fields.text("created");
    info.source = fields.text("source");
    info.rig = fields.text("rig");
    info.camera = fields.text("camera");
    info.planned_shots = fields.integer<int>("planned_shots");
    info.notes = fields.texts("notes");
    info.record = object_record_from(fields);
    if (fields.has("geometry")) info.geometry = geometry_from({fields.where(), fields.member("geometry")});
    info.retakes = reference_from(fields, "retakes");
    info.flats = reference_from(fields, "flats");
    require_valid(fields.where(), info);
    return info;
}

SessionEvent event_from(const Fields& fields) { return {fields.text("when"), fields.text("what")}; }

FrameRecord record_from(const Fields& fields) {
    FrameRecord record;
    record.file = fields.text("file");
    record.kind = fields.named("kind", frame_kind_from_name);
    record.format = fields.text("format");
    record.width = fields.integer<int>("width");
    record.height = fields.integer<int>("height");
    record.bit_depth = fields.integer<int>("bit_depth");
    record.black_level = fields.number("black_level");
    record.transfer = fields.named("transfer", transfer_curve_from_name);
    if (!fields.member("lamp").is_null()) record.lamp = LampId{fields.integer<std::uint32_t>("lamp")};
    record.lamp_name = fields.text("lamp_name");
    record.exposure_s = fields.number("exposure_s");
    record.gain = fields.number("gain");
    record.sequence = fields.integer<std::uint64_t>("sequence");
    record.timestamp_ns = fields.integer<std::int64_t>("timestamp_ns");
    record.lamp_on_ns = fields.integer<std::int64_t>("lamp_on_ns");
    record.lamp_off_ns = fields.integer<std::int64_t>("lamp_off_ns");
    record.verified = fields.flag("verified");
    record.verification = fields.text("verification");
    record.sha256 = fields.text("sha256");
    if (fields.has("noise")) {
        const Fields noise(fields.where(), fields.member("noise"));
        record.noise = {noise.number("floor"), noise.number("slope")};
    }
    if (fields.has("taken_over_from")) record.taken_over_from = fields.text("taken_over_from");
    require_valid(fields.where(), record);
    require_sha256(fields.where(), record.sha256);
    return record;
}

Payload extra_from(const Fields& fields) {
    Payload extra{fields.text("name"), fields.integer<std::uint64_t>("size"), fields.text("sha256")};
    require_payload_name(fields.where(), extra.name);
    require_sha256(fields.where(), extra.sha256);
    return extra;
}

struct EntryToJson {
    Json operator()(const FrameEntry& entry) const { return {{"frame", json_of(entry.record)}, {"size", entry.size}}; }
    Json operator()(const Payload& extra) const {
        return {{"extra", {{"name", extra.name}, {"size", extra.size}, {"sha256", extra.sha256}}}};
    }
    Json operator()(const SessionEvent& event) const { return {{"event", json_of(event)}}; }
    Json operator()(const NoteEntry& entry) const { return {{"note", entry.note}}; }
    Json operator()(const WithdrawnEntry& entry) const { return {{"withdrawn", entry.file}, {"why", entry.why}}; }
};

}  // namespace

std::string journal_head(const SessionInfo& info) {
    return dump({{"schema_version", session_schema}, {"session", json_of(info)}}, -1);
}

std::string journal_line(const JournalEntry& entry) { return dump(std::visit(EntryToJson{}, entry), -1); }

std::string session_document(const SessionContents& contents) {
    Json frames = Json::array();
    for (const FrameRecord& record : contents.frames) frames.push_back(json_of(record));
    Json events = Json::array();
    for (const SessionEvent& event : contents.events) events.push_back(json_of(event));
    const Json rig = contents.holds("rig.toml") ? Json("rig.toml") : Json();
    return dump({{"schema_version", session_schema},
                 {"session", json_of(contents.info)},
                 {"rig_snapshot", rig},
                 {"frames", std::move(frames)},
                 {"events", std::move(events)}},
                2) +
           "\n";
}

SessionInfo parse_journal_head(const std::string& where, std::string_view line) {
    const Json json = parse(where, line);
    const Fields fields(where, json);
    known_schema(fields);
    return info_from({where, fields.member("session")});
}

JournalEntry parse_journal_line(const std::string& where, std::string_view line) {
    const Json json = parse(where, line);
    const Fields fields(where, json);
    if (fields.has("frame"))
        return FrameEntry{record_from({where, fields.member("frame")}), fields.integer<std::uint64_t>("size")};
    if (fields.has("extra")) return extra_from({where, fields.member("extra")});
    if (fields.has("event")) return event_from({where, fields.member("event")});
    if (fields.has("note")) return NoteEntry{fields.text("note")};
    if (fields.has("withdrawn")) return WithdrawnEntry{fields.text("withdrawn"), fields.text("why")};
    refuse(where, "neither a frame nor an extra, event, note or withdrawal");
}

SessionDocument parse_session_document(const std::string& where, std::string_view text) {
    const Json json = parse(where, text);
    const Fields fields(where, json);
    SessionDocument document;
    const int version = known_schema(fields);
    document.info = info_from({where, fields.member("session")});
    document.info.schema_version = version;
    std::size_t count = 0;
    for (const Json& frame : fields.array("frames"))
        document.frames.push_back(record_from({fmt::format("{}: frame {}", where, count++), frame}));
    for (const Json& event : fields.array("events")) document.events.push_back(event_from({where, event}));
    return document;
}

}  // namespace darkbox
