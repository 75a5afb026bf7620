#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace darkbox {

/// The numbers are syslog's (RFC 5424, section 6.2.1), which journald's PRIORITY uses as well.
enum class LogLevel { error = 3, warning = 4, notice = 5, info = 6, debug = 7 };
std::string_view name(LogLevel level);
/// Throws InputError that lists the names.
LogLevel log_level_from_name(const std::string& name);

/// Name and value; the names are those of the API in lower case, such as session, lamp, frame, job.
using LogFields = std::vector<std::pair<std::string, std::string>>;

struct LogLine {
    LogLevel level = LogLevel::info;
    std::string message;
    LogFields fields = {};
};

/// Takes lines; thread-safe, and never throws: a log is not worth a capture.
using LogSink = std::function<void(const LogLine&)>;

/// "level=info msg="frame taken" session=vase lamp=lamp-01": one line, values in quotes where they hold a blank, a
/// quote, a backslash, "=" or a control character, which are then written as in JSON.
std::string key_value_line(const LogLine& line);

/// journald's native protocol (systemd.io/JOURNAL_NATIVE_PROTOCOL): MESSAGE, PRIORITY, SYSLOG_IDENTIFIER, and each
/// field as DARKBOX_NAME. A value with a line break goes with its length before it.
std::string journal_datagram(const LogLine& line);

/// Lines of this level and worse, to journald as fields where stderr leads there ($JOURNAL_STREAM names it), else to
/// stderr as key=value.
LogSink log_sink(LogLevel most);
/// To this socket of journald's; a datagram that it does not take goes to `otherwise`.
LogSink journal_sink(const std::string& socket, LogLevel most, LogSink otherwise);

/// What of the daemon's events belongs into a log; no message for those that do not.
LogLine log_line_of(const std::string& event, const nlohmann::json& fields);

}  // namespace darkbox
