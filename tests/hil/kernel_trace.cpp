#include "tests/hil/kernel_trace.h"

#include <filesystem>
#include <sstream>

#include "tests/hil/machine.h"

namespace darkbox::test {
namespace {

const std::filesystem::path tracing = "/sys/kernel/tracing";

/// "     darkboxd-123     [000] d..1.    12.345678: gpio_value: 499 set 1"; a name may hold blanks and hyphens.
TraceEvent parsed(const std::string& line) {
    TraceEvent event;
    const std::size_t bracket = line.find(" [");
    const std::size_t hyphen = line.rfind('-', bracket);
    const std::size_t time_end = line.find(": ", bracket);
    const std::size_t name_end = line.find(": ", time_end + 2);
    if (name_end == std::string::npos || hyphen == std::string::npos) return event;
    const std::size_t begin = line.find_first_not_of(' ');
    event.task = line.substr(begin, hyphen - begin);
    event.process = std::stoi(line.substr(hyphen + 1));
    event.name = line.substr(time_end + 2, name_end - time_end - 2);
    event.text = line.substr(name_end + 2);
    return event;
}

}  // namespace

KernelTrace::KernelTrace(std::vector<std::string> events) : names_(std::move(events)) {
    put("nop", tracing / "current_tracer");
    shell("echo > " + (tracing / "trace").string());
    for (const std::string& name : names_) put("1", tracing / "events" / name / "enable");
    put("1", tracing / "tracing_on");
}

KernelTrace::~KernelTrace() {
    for (const std::string& name : names_) shell("echo 0 > " + (tracing / "events" / name / "enable").string());
}

std::vector<TraceEvent> KernelTrace::events() const {
    std::vector<TraceEvent> events;
    std::istringstream lines(text_of(tracing / "trace"));
    for (std::string line; std::getline(lines, line);)
        if (!line.empty() && line.front() != '#') events.push_back(parsed(line));
    return events;
}

std::vector<LineChange> line_changes(const std::vector<TraceEvent>& events, unsigned int first_number) {
    std::vector<LineChange> changes;
    for (const TraceEvent& event : events) {
        if (event.name != "gpio_value") continue;
        std::istringstream text(event.text);
        unsigned int number = 0;
        std::string what;
        int high = 0;
        if (text >> number >> what >> high && what == "set") changes.push_back({number - first_number, high != 0});
    }
    return changes;
}

}  // namespace darkbox::test
