#include "rig/cli/arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "rig/cli/command_line.h"

namespace darkbox {
namespace {

constexpr double shortest_direction = 1e-6;

[[noreturn]] void malformed(const std::string& option, const std::string& text, const std::string& form) {
    throw UsageError(fmt::format("{} '{}' is not {}", option, text, form), "see --help for an example");
}

/// "X,Y,Z" or "X,Y,Z:R,G,B": the first three as `direction`, whatever they mean.
Light light_of(const std::string& option, const std::string& text) {
    const auto at = text.find(':');
    const auto d = parse_numbers(option, text.substr(0, at), 3);
    Light light;
    light.file = text;
    light.direction = {d[0], d[1], d[2]};
    if (at == std::string::npos) return light;
    const auto i = parse_numbers(option, text.substr(at + 1), 3);
    light.intensity = {i[0], i[1], i[2]};
    if ((light.intensity.array() < 0).any())
        throw UsageError(fmt::format("{} '{}' has a negative intensity", option, text), "intensities are 0 or more");
    return light;
}

}  // namespace

std::vector<double> parse_numbers(const std::string& option, const std::string& text, std::size_t count) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (at <= end) {
        double number = 0;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc() || !std::isfinite(number) || (next != end && *next != ',')) break;
        numbers.push_back(number);
        if (next == end) {
            if (numbers.size() == count) return numbers;
            break;
        }
        at = next + 1;
    }
    malformed(option, text, fmt::format("{} numbers with commas between them", count));
}

Ball parse_ball(const std::string& text) {
    const auto n = parse_numbers("--ball", text, 3);
    return {n[0], n[1], n[2], 1.0};
}

GreyCard parse_grey_card(const std::string& text) {
    const auto n = parse_numbers("--grey-card", text, 4);
    if (!std::all_of(n.begin(), n.end(), [](double v) { return v >= 0 && v < 1e6 && v == std::floor(v); }))
        malformed("--grey-card", text, "X,Y,WIDTH,HEIGHT in whole pixels");
    GreyCard card;
    if (n[2] < 1 || n[3] < 1) malformed("--grey-card", text, "X,Y,WIDTH,HEIGHT of one pixel or more");
    card.area = {static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]), static_cast<int>(n[3])};
    return card;
}

std::pair<std::string, cv::Point2d> parse_highlight(const std::string& text) {
    const auto equals = text.rfind('=');
    if (equals == std::string::npos || equals == 0) malformed("--highlight", text, "of the form FRAME=X,Y");
    const auto n = parse_numbers("--highlight", text.substr(equals + 1), 2);
    return {text.substr(0, equals), {n[0], n[1]}};
}

Light parse_light(const std::string& text) {
    Light light = light_of("--light", text);
    if (light.direction.norm() < shortest_direction)
        throw UsageError(fmt::format("--light '{}' has no direction", text),
                         "give a vector from the object to the light");
    light.direction.normalize();
    return light;
}

Light parse_lamp_position(const std::string& text, const Eigen::Vector3d& object_mm) {
    Light light = light_of("--light-position", text);
    light.near = LampPosition{light.direction, object_mm};
    light.direction -= object_mm;
    if (light.direction.norm() < shortest_direction)
        throw UsageError(fmt::format("--light-position '{}' is in the object itself", text),
                         "give a place off the object, in millimetres: x to the right, y up, z to the camera");
    light.direction.normalize();
    return light;
}

std::string in_options(const std::string& message, const std::vector<std::string>& given) {
    constexpr std::string_view field_characters = "abcdefghijklmnopqrstuvwxyz_";
    const auto verb = message.find(" is ");
    if (verb == std::string::npos) return message;
    const auto before = message.find_last_not_of(field_characters, verb - 1);
    const std::size_t start = verb == 0 || before == std::string::npos ? 0 : before + 1;
    const std::string field = message.substr(start, verb - start);
    for (const std::string& option : given) {
        std::string name = option;
        std::replace(name.begin(), name.end(), '-', '_');
        const bool with_unit = field == name + "_mm" || field == name + "_px" || field == name + "_deg";
        if (field == name || with_unit || field.ends_with("_" + name)) return "--" + option + message.substr(verb);
    }
    return message;
}

void require_outside_payload(const std::filesystem::path& out) {
    namespace fs = std::filesystem;
    for (fs::path part = fs::weakly_canonical(fs::absolute(out)); part.has_relative_path(); part = part.parent_path())
        if (part.filename() == "data" &&
            (fs::exists(part.parent_path() / "bagit.txt") || fs::exists(part.parent_path() / "journal.jsonl")))
            throw InputError(fmt::format("'{}' lies inside the session {}", out.string(), part.parent_path().string()),
                             "write elsewhere: a session's data is never edited");
}

}  // namespace darkbox
