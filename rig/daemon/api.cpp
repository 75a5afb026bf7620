#include "rig/daemon/api.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "rig/daemon/api_words.h"

namespace darkbox {
namespace {

constexpr std::string_view prefix = "/api/v1/";

std::string_view title(int status) {
    switch (status) {
        case 400:
            return "Bad Request";
        case 401:
            return "Unauthorized";
        case 403:
            return "Forbidden";
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
        case 416:
            return "Range Not Satisfiable";
        case 421:
            return "Misdirected Request";
        case 429:
            return "Too Many Requests";
        case 431:
            return "Request Header Fields Too Large";
        case 503:
            return "Service Unavailable";
        case 507:
            return "Insufficient Storage";
        default:
            return "Internal Server Error";
    }
}

[[noreturn]] void no_such_address() {
    throw Rejected{404, "there is nothing at this address", "see GET /api/v1/openapi.json"};
}

std::vector<std::string_view> split(std::string_view text, char at) {
    std::vector<std::string_view> parts;
    while (true) {
        const auto end = text.find(at);
        parts.push_back(text.substr(0, end));
        if (end == text.npos) return parts;
        text.remove_prefix(end + 1);
    }
}

/// "%2e" becomes "."; throws InputError for what is not two hexadecimal digits.
std::string decoded(std::string_view text) {
    const auto digit = [](char c) {
        if (c >= '0' && c <= '9') return c - '0';
        if (c >= 'a' && c <= 'f') return c - 'a' + 10;
        if (c >= 'A' && c <= 'F') return c - 'A' + 10;
        throw InputError("the address has a broken percent sign", "write %25 for a percent sign");
    };
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            result += text[i];
            continue;
        }
        if (i + 2 >= text.size()) throw InputError("the address has a broken percent sign", "write %25 for it");
        result += static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2]));
        i += 2;
    }
    return result;
}

/// What stands for {name} in the template, when the address fits it.
std::optional<std::map<std::string, std::string>> match(std::string_view pattern, std::string_view address) {
    std::map<std::string, std::string> parts;
    const auto wanted = split(pattern, '/');
    const auto given = split(address, '/');
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (i >= given.size()) return std::nullopt;
        if (wanted[i] == "{path}") {
            const auto start = static_cast<std::size_t>(given[i].data() - address.data());
            parts["path"] = decoded(address.substr(start));
            return parts;
        }
        const bool variable = wanted[i].starts_with('{');
        if (variable) {
            parts[std::string(wanted[i].substr(1, wanted[i].size() - 2))] = decoded(given[i]);
        } else if (wanted[i] != given[i]) {
            return std::nullopt;
        }
    }
    if (given.size() != wanted.size()) return std::nullopt;
    return parts;
}

std::map<std::string, std::string> parse_query(std::string_view query, const std::vector<std::string_view>& known) {
    std::map<std::string, std::string> values;
    if (query.empty()) return values;
    for (const std::string_view pair : split(query, '&')) {
        const auto equals = pair.find('=');
        const std::string_view key = pair.substr(0, equals);
        if (std::ranges::find(known, key) == known.end() || equals == pair.npos)
            throw InputError("unknown query", known.empty() ? std::string("leave out what follows the question mark")
                                                            : fmt::format("known: {}", fmt::join(known, ", ")));
        values[std::string(key)] = decoded(pair.substr(equals + 1));
    }
    return values;
}

}  // namespace

ApiResponse problem(int status, const std::string& detail, const std::string& hint) {
    ApiResponse response = reply(
        {{"type", "about:blank"}, {"title", title(status)}, {"status", status}, {"detail", detail}, {"hint", hint}},
        status);
    response.content_type = "application/problem+json";
    return response;
}

Api::Api(const RigDescription& rig, Service& service, Metrics& metrics)
    : rig_(rig), service_(service), metrics_(metrics) {}

const std::vector<Api::Route>& Api::table() {
    static const std::vector<Route> routes{
        {"GET", "status", {}, &Api::status},
        {"GET", "lamps", {}, &Api::lamps},
        {"GET", "dose", {}, &Api::dose},
        {"POST", "lamps/dark", {}, &Api::darken},
        {"POST", "lamps/on", {}, &Api::light},
        {"GET", "events", {"after"}, &Api::events},
        {"GET", "preview", {}, &Api::preview},
        {"POST", "captures", {}, &Api::start_capture},
        {"GET", "jobs", {"after", "limit"}, &Api::jobs},
        {"POST", "jobs", {}, &Api::enqueue},
        {"GET", "jobs/{id}", {}, &Api::job},
        {"DELETE", "jobs/{id}", {}, &Api::cancel},
        {"GET", "jobs/{id}/log", {}, &Api::job_log},
        {"GET", "sessions", {"after", "find", "limit"}, &Api::sessions},
        {"GET", "sessions/{name}", {}, &Api::session},
        {"GET", "sessions/{name}/files", {}, &Api::files},
        {"GET", "sessions/{name}/files/{path}", {}, &Api::file},
        {"GET", "calibrations", {"after", "limit"}, &Api::calibrations},
        {"POST", "catalog/rebuild", {}, &Api::rebuild},
        {"GET", "openapi.json", {}, &Api::openapi},
    };
    return routes;
}

std::vector<std::string> Api::routes() const {
    std::vector<std::string> names;
    for (const Route& route : table()) names.push_back(fmt::format("{} {}", route.method, route.address));
    return names;
}

ApiResponse Api::answer(const ApiRequest& request) const noexcept {
    ApiResponse response;
    try {
        response = route(request);
    } catch (const Rejected& rejected) {
        response = problem(rejected.status, rejected.detail, rejected.hint);
        response.allow = rejected.allow;
    } catch (const NotFound& error) {
        response = problem(404, error.what(), error.hint());
    } catch (const Refused& error) {
        response = problem(409, error.what(), error.hint());
    } catch (const NoRoom& error) {
        response = problem(507, error.what(), error.hint());
    } catch (const InputError& error) {
        response = problem(400, error.what(), error.hint());
    } catch (const Error& error) {
        response = problem(500, error.what(), error.hint());
    } catch (const std::exception& error) {
        response = problem(500, error.what(), "this is a defect of darkbox; please report it");
    }
    metrics_.count_request(response.status);
    return response;
}

ApiResponse Api::route(const ApiRequest& request) const {
    const std::string_view target = request.target;
    const auto question = target.find('?');
    const std::string_view query = question == target.npos ? "" : target.substr(question + 1);
    std::string_view address = target.substr(0, question);
    if (address == "/metrics") {
        if (request.method != "GET") throw Rejected{405, "/metrics is to be read", "use GET", "GET"};
        ApiResponse response{.content_type = "text/plain; version=0.0.4", .body = metrics_.text(service_)};
        return response;
    }
    if (!address.starts_with(prefix)) no_such_address();
    address.remove_prefix(prefix.size());

    std::vector<std::string_view> methods;
    for (const Route& route : table()) {
        auto parts = match(route.address, address);
        if (!parts) continue;
        methods.push_back(route.method);
        if (route.method == request.method)
            return (this->*route.handler)({request, std::move(*parts), parse_query(query, route.query)});
    }
    if (methods.empty()) no_such_address();
    const std::string list = fmt::format("{}", fmt::join(methods, ", "));
    throw Rejected{405, fmt::format("{} is not what this address takes", request.method.substr(0, 20)), "use " + list,
                   list};
}

}  // namespace darkbox
