#pragma once

#include <string>
#include <vector>

namespace darkbox::test {

/// What the kernel itself recorded (ftrace), in order: an account that no program of darkbox has a hand in.
struct TraceEvent {
    std::string task;  ///< that ran
    int process = 0;   ///< its id
    std::string name;  ///< "gpio_value"
    std::string text;  ///< "499 set 1"
};

/// Records from its constructor to its destructor. One at a time.
class KernelTrace {
public:
    /// `events` as "gpio/gpio_value".
    explicit KernelTrace(std::vector<std::string> events);
    KernelTrace(const KernelTrace&) = delete;
    KernelTrace& operator=(const KernelTrace&) = delete;
    ~KernelTrace();

    std::vector<TraceEvent> events() const;

private:
    std::vector<std::string> names_;
};

/// A change of a line that a program asked for.
struct LineChange {
    unsigned int offset = 0;
    bool high = false;
    friend bool operator==(const LineChange&, const LineChange&) = default;
};
/// Of the chip whose line 0 has this number; no value for other events.
std::vector<LineChange> line_changes(const std::vector<TraceEvent>& events, unsigned int first_number);

}  // namespace darkbox::test
