#include "rig/daemon/api_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

struct Range {
    std::uint64_t first = 0;
    std::uint64_t length = 0;
};

std::optional<std::uint64_t> digits(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
    return value;
}

struct Asked {
    bool one_range = false;  ///< else the whole file is sent
    std::optional<Range> range = {};
};

/// "bytes=FIRST-LAST", "bytes=FIRST-" or "bytes=-COUNT". What is not understood is ignored, as the standard wants.
Asked asked_range(std::string_view text, std::uint64_t size) {
    constexpr std::string_view unit = "bytes=";
    if (!text.starts_with(unit) || text.find(',') != text.npos) return {};
    text.remove_prefix(unit.size());
    const auto dash = text.find('-');
    if (dash == text.npos) return {};
    const auto first = digits(text.substr(0, dash));
    const auto last = digits(text.substr(dash + 1));
    if (dash == 0) {
        if (!last) return {};
        const std::uint64_t length = std::min(*last, size);
        return {true, length == 0 ? std::nullopt : std::optional(Range{size - length, length})};
    }
    if (!first || (!last && dash + 1 != text.size()) || (last && *last < *first)) return {};
    if (*first >= size) return {true, std::nullopt};
    const std::uint64_t end = last ? std::min(*last, size - 1) : size - 1;
    return {true, Range{*first, end - *first + 1}};
}

}  // namespace

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

ApiResponse reply(const Json& json, int status) {
    ApiResponse response;
    response.status = status;
    response.body = dump(json) + "\n";
    return response;
}

std::uint64_t number(std::string_view text, const std::string& what) {
    if (const auto value = digits(text)) return *value;
    throw InputError(fmt::format("{} is not a number", what), "use digits only");
}

Json to_json(const CatalogFrame& f) {
    return {{"file", f.file},
            {"kind", f.kind},
            {"lamp", f.lamp},
            {"format", f.format},
            {"width", f.width},
            {"height", f.height},
            {"exposure_s", f.exposure_s},
            {"gain", f.gain},
            {"sequence", f.sequence},
            {"timestamp_ns", f.timestamp_ns},
            {"verified", f.verified},
            {"sha256", f.sha256}};
}

Json to_json(const CatalogCalibration& c) {
    return {{"session", c.session},
            {"created", c.created},
            {"rig", c.rig},
            {"lamps", c.lamps},
            {"used", c.used},
            {"condition_number", c.condition_number},
            {"sigma_deg", c.sigma_deg},
            {"intensities_known", c.intensities_known},
            {"warnings", c.warnings}};
}

Json to_json(const CatalogDrift& d) {
    Json findings = Json::parse(d.findings_json, nullptr, false);
    if (!findings.is_array()) findings = Json::array();
    return {{"against", d.against}, {"role", d.role}, {"steady", d.steady}, {"alarm", d.alarm}, {"findings", findings}};
}

ApiResponse answer_with_file(OpenFile file, const std::string& content_type, const ApiRequest& request) {
    ApiResponse response;
    response.content_type = content_type;
    response.headers = {{"ETag", file.tag}, {"Accept-Ranges", "bytes"}, {"X-Content-Type-Options", "nosniff"}};
    if (!request.if_none_match.empty() && request.if_none_match == file.tag) {
        response.status = 304;
        return response;
    }
    const bool same_file = request.if_range.empty() || request.if_range == file.tag;
    const Asked asked = same_file ? asked_range(request.range, file.size) : Asked{};
    if (asked.one_range && !asked.range) {
        ApiResponse refused = problem(416, "the file does not reach that far", "ask for bytes that it has");
        refused.headers.emplace_back("Content-Range", fmt::format("bytes */{}", file.size));
        return refused;
    }
    const Range range = asked.range.value_or(Range{0, file.size});
    if (asked.range) {
        response.status = 206;
        response.headers.emplace_back(
            "Content-Range", fmt::format("bytes {}-{}/{}", range.first, range.first + range.length - 1, file.size));
    }
    response.file = FileSlice{std::move(file.fd), range.first, range.length};
    return response;
}

std::string content_type_of(const std::string& name) {
    constexpr std::array<std::pair<std::string_view, const char*>, 10> types{{{".json", "application/json"},
                                                                              {".jsonl", "application/x-ndjson"},
                                                                              {".png", "image/png"},
                                                                              {".jpg", "image/jpeg"},
                                                                              {".jpeg", "image/jpeg"},
                                                                              {".tif", "image/tiff"},
                                                                              {".exr", "image/x-exr"},
                                                                              {".txt", "text/plain; charset=utf-8"},
                                                                              {".toml", "text/plain; charset=utf-8"},
                                                                              {".html", "text/html; charset=utf-8"}}};
    for (const auto& [ending, type] : types)
        if (name.ends_with(ending)) return type;
    return "application/octet-stream";
}

}  // namespace darkbox
