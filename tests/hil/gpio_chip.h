#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace darkbox::test {

/// A GPIO chip of the kernel's gpio-sim, plugged in by its constructor: what a program does to its lines is seen in
/// sysfs, from outside that program. Lines that nobody holds are what their pull makes them: low.
class GpioChip {
public:
    struct Lines {
        unsigned int count = 16;
        std::map<unsigned int, std::string> names = {};  ///< of those that have one
        std::map<unsigned int, std::string> hogs = {};   ///< offset -> who in the kernel holds it
    };
    explicit GpioChip(std::string label) : GpioChip(std::move(label), Lines()) {}
    GpioChip(std::string label, const Lines& lines);
    GpioChip(const GpioChip&) = delete;
    GpioChip& operator=(const GpioChip&) = delete;
    ~GpioChip();

    void plug();
    void unplug();
    /// As a resistor would: what the line is while nobody drives it.
    void pull_up(unsigned int offset) const;

    bool is_high(unsigned int offset) const;
    std::vector<unsigned int> high_lines() const;
    const std::string& label() const { return label_; }
    /// Its folder in sysfs, where sim_gpioN/value is.
    std::filesystem::path folder() const;
    /// The number that the kernel gives its line 0 in traces.
    unsigned int first_number() const;

private:
    std::filesystem::path config() const;

    std::string label_;
    unsigned int count_;
};

}  // namespace darkbox::test
