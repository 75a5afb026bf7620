#include "rig/daemon/capture_order_json.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

constexpr std::size_t longest_text = 200;  ///< bytes
constexpr std::size_t most_lamps = 1024;

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

std::vector<std::string> texts(const Json& value, const std::string& key) {
    if (!value.is_array() || value.size() > most_lamps)
        throw InputError(fmt::format("\"{}\" is not a list of up to {} names", key, most_lamps),
                         R"(write ["lamp-01", "lamp-02"])");
    std::vector<std::string> result;
    for (const Json& item : value) result.push_back(text(item, key));
    return result;
}

}  // namespace

CaptureOrder parse_capture_order(const std::string& body) {
    const Json json = Json::parse(body, nullptr, /*allow_exceptions=*/false);
    if (json.is_discarded()) throw InputError("the request's body is not JSON", "send one JSON object");
    if (!json.is_object()) throw InputError("the request's body is not a JSON object", "send one JSON object");
    CaptureOrder order;
    for (const auto& [key, value] : json.items()) {
        if (key == "object") {
            order.object = text(value, key);
        } else if (key == "name") {
            order.name = text(value, key);
        } else if (key == "resume") {
            order.resume = text(value, key);
        } else if (key == "lamps") {
            order.lamps = texts(value, key);
        } else if (key == "mode") {
            order.mode = sync_mode_from_name(text(value, key));
            if (!order.mode)
                throw InputError(fmt::format("unknown mode \"{}\"", text(value, key)),
                                 "known: settled, predictive, strobed");
        } else {
            throw InputError(fmt::format("unknown key \"{}\"", key.substr(0, longest_text)),
                             "known: object, lamps, mode, name, resume");
        }
    }
    return order;
}

Json to_json(const CaptureOrder& order) {
    Json json = Json::object();
    if (!order.object.empty()) json["object"] = order.object;
    if (!order.name.empty()) json["name"] = order.name;
    if (!order.lamps.empty()) json["lamps"] = order.lamps;
    if (order.mode) json["mode"] = name(*order.mode);
    if (order.resume) json["resume"] = *order.resume;
    return json;
}

}  // namespace darkbox
