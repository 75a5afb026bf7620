#include "rig/description/capture_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace darkbox {
namespace {

constexpr std::size_t most_brackets = 8;
constexpr double widest_bracket = 1000;

std::vector<double> read_brackets(TomlSection& section) {
    const std::vector<double> brackets = section.numbers_up_to("brackets", most_brackets);
    for (const double factor : brackets)
        if (!(factor >= 1 / widest_bracket && factor <= widest_bracket))
            section.fail(
                "brackets",
                fmt::format("brackets holds {}; allowed: {} to {}", factor, 1 / widest_bracket, widest_bracket),
                "give multiples of the exposure, such as [1, 0.25]");
    std::vector<double> sorted = brackets;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        section.fail("brackets", "brackets holds an exposure twice", "averages = 2 takes every frame twice");
    return brackets;
}

}  // namespace

CaptureDescription read_capture(TomlSection& section) {
    CaptureDescription capture;
    section.allow({"mode", "exposure", "ambient", "dark_every", "averages", "brackets", "frame_deadline_s", "tries",
                   "min_signal", "max_dark", "lamp_places", "closing_repeat"});
    capture.mode = *sync_mode_from_name(
        section.choice("mode", std::string(name(capture.mode)), {"settled", "predictive", "strobed"}));
    capture.metered = section.choice("exposure", "fixed", {"fixed", "metered"}) == "metered";
    capture.ambient = section.flag("ambient").value_or(capture.ambient);
    capture.dark_every = static_cast<int>(section.integer("dark_every", {1, 10'000}).value_or(capture.dark_every));
    capture.averages = static_cast<int>(section.integer("averages", {1, 256}).value_or(capture.averages));
    if (section.has("brackets")) capture.brackets = read_brackets(section);
    capture.frame_deadline =
        Seconds(section.number("frame_deadline_s", {0.01, 600}).value_or(capture.frame_deadline.count()));
    capture.tries = static_cast<int>(section.integer("tries", {1, 100}).value_or(capture.tries));
    capture.min_signal = section.number("min_signal", {0.0001, 0.5}).value_or(capture.min_signal);
    capture.max_dark = section.number("max_dark", {0, 0.5}).value_or(capture.max_dark);
    capture.closing_repeat = section.flag("closing_repeat").value_or(capture.closing_repeat);
    capture.lamp_places = section.flag("lamp_places").value_or(capture.lamp_places);
    return capture;
}

std::string_view name(SyncMode mode) {
    switch (mode) {
        case SyncMode::settled:
            return "settled";
        case SyncMode::predictive:
            return "predictive";
        case SyncMode::strobed:
            break;
    }
    return "strobed";
}

std::optional<SyncMode> sync_mode_from_name(std::string_view text) {
    for (const SyncMode mode : {SyncMode::settled, SyncMode::predictive, SyncMode::strobed})
        if (name(mode) == text) return mode;
    return std::nullopt;
}

}  // namespace darkbox
