#include "rig/daemon/structured_log.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;

constexpr std::array levels{std::pair{LogLevel::error, "error"}, std::pair{LogLevel::warning, "warning"},
                            std::pair{LogLevel::notice, "notice"}, std::pair{LogLevel::info, "info"},
                            std::pair{LogLevel::debug, "debug"}};

bool is_plain(char c) { return c > ' ' && c != '"' && c != '\\' && c != '=' && c != 0x7F; }

std::string quoted(const std::string& value) {
    const bool plain = !value.empty() && std::ranges::all_of(value, [](char c) {
        return is_plain(c) || (static_cast<unsigned char>(c) & 0x80) != 0;
    });
    return plain ? value : Json(value).dump(-1, ' ', false, Json::error_handler_t::replace);
}

void add_field(std::string& datagram, std::string_view name, const std::string& value) {
    if (value.find('\n') == std::string::npos) {
        datagram += fmt::format("{}={}\n", name, value);
        return;
    }
    datagram += fmt::format("{}\n", name);
    for (std::uint64_t length = value.size(), i = 0; i < 8; ++i, length >>= 8)
        datagram += static_cast<char>(length & 0xFF);  // 64 bits, the least first
    datagram += value + "\n";
}

/// Names of fields hold capitals, digits and underscores, and are at most 64 bytes long.
std::string journal_name_of(const std::string& name) {
    std::string result = "DARKBOX_";
    for (const char c : name.substr(0, 50))
        result += std::isalnum(static_cast<unsigned char>(c)) != 0
                      ? static_cast<char>(std::toupper(static_cast<unsigned char>(c)))
                      : '_';
    return result;
}

/// Whether stderr is the stream that systemd connected to journald: "device:inode" (systemd.exec(5), $JOURNAL_STREAM).
bool stderr_is_journal() {
    const char* stream = std::getenv("JOURNAL_STREAM");
    struct stat there{};
    return stream != nullptr && ::fstat(STDERR_FILENO, &there) == 0 &&
           fmt::format("{}:{}", there.st_dev, there.st_ino) == stream;
}

LogSink stderr_sink(LogLevel most) {
    return [most](const LogLine& line) {
        if (line.level <= most) std::fputs((key_value_line(line) + "\n").c_str(), stderr);
    };
}

std::string text(const Json& fields, const char* key) {
    const auto found = fields.find(key);
    if (found == fields.end() || found->is_null()) return "";
    return found->is_string() ? found->get<std::string>() : found->dump();
}

/// Those of the named keys that say something.
LogFields picked(const Json& fields, std::initializer_list<const char*> keys) {
    LogFields result;
    for (const char* key : keys)
        if (std::string value = text(fields, key); !value.empty()) result.emplace_back(key, std::move(value));
    return result;
}

}  // namespace

std::string_view name(LogLevel level) {
    const auto* found = std::ranges::find(levels, level, [](const auto& entry) { return entry.first; });
    return found->second;
}

LogLevel log_level_from_name(const std::string& name) {
    for (const auto& [level, known] : levels)
        if (name == known) return level;
    throw InputError(fmt::format("there is no log level \"{}\"", name), "known: error, warning, notice, info, debug");
}

std::string key_value_line(const LogLine& line) {
    std::string result = fmt::format("level={} msg={}", name(line.level), quoted(line.message));
    for (const auto& [name, value] : line.fields) result += fmt::format(" {}={}", name, quoted(value));
    return result;
}

std::string journal_datagram(const LogLine& line) {
    std::string datagram;
    add_field(datagram, "MESSAGE", line.message);
    add_field(datagram, "PRIORITY", std::to_string(static_cast<int>(line.level)));
    add_field(datagram, "SYSLOG_IDENTIFIER", "darkboxd");
    for (const auto& [name, value] : line.fields) add_field(datagram, journal_name_of(name), value);
    return datagram;
}

LogSink journal_sink(const std::string& socket, LogLevel most, LogSink otherwise) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (socket.size() >= sizeof address.sun_path) return otherwise;
    std::memcpy(address.sun_path, socket.c_str(), socket.size());
    const auto fd = std::make_shared<UniqueFd>(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    return [address, fd, most, otherwise = std::move(otherwise)](const LogLine& line) {
        if (line.level > most) return;
        const std::string datagram = journal_datagram(line);
        const auto* to = reinterpret_cast<const sockaddr*>(&address);
        const ssize_t sent = ::sendto(fd->get(), datagram.data(), datagram.size(), MSG_NOSIGNAL, to, sizeof address);
        if (sent < 0) otherwise(line);
    };
}

LogSink log_sink(LogLevel most) {
    if (!stderr_is_journal()) return stderr_sink(most);
    return journal_sink("/run/systemd/journal/socket", most, stderr_sink(most));
}

LogLine log_line_of(const std::string& event, const Json& fields) {
    if (event == "state") {
        const std::string problem = text(fields, "problem");
        return {problem.empty() ? LogLevel::info : LogLevel::warning, "the rig is " + text(fields, "state"),
                picked(fields, {"state", "problem"})};
    }
    if (event == "lamps") {
        const bool dark = fields.value("dark", false);
        return {dark ? LogLevel::debug : LogLevel::error,
                dark ? "all lamps are dark" : "the lamps could not be proven dark", picked(fields, {"detail"})};
    }
    if (event == "light")
        return {fields.value("lit", false) ? LogLevel::info : LogLevel::error,
                "a lamp by hand: " + text(fields, "detail"), picked(fields, {"hint"})};
    if (event == "problem") return {LogLevel::error, text(fields, "detail"), picked(fields, {"job", "hint"})};
    if (event == "progress")
        return {LogLevel::debug, "progress", picked(fields, {"job", "stage", "done", "total", "detail"})};
    const std::string what = fmt::format("{} {}", text(fields, "kind"), event);
    if (event == "done")
        return {LogLevel::info, what, picked(fields, {"job", "kind", "session", "frames", "repeated", "next"})};
    if (event == "cancelled") return {LogLevel::notice, what, picked(fields, {"job", "kind", "session", "detail"})};
    return {LogLevel::error, what, picked(fields, {"job", "kind", "session", "detail", "hint"})};
}

}  // namespace darkbox
