#include "rig/lamps/guardian_packets.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

template <std::size_t Size>
void put_cut(const std::string& text, std::array<char, Size>& field) {
    text.copy(field.data(), Size - 1);
}

template <std::size_t Size>
void put_whole(const std::string& text, std::array<char, Size>& field) {
    if (text.empty() || text.size() >= Size || text.find('\0') != text.npos)
        throw InputError(
            fmt::format("\"{}\" is no name of a GPIO chip or line: allowed are 1 to {} characters", text, Size - 1),
            "gpiodetect and gpioinfo list the names; correct it in rig.toml");
    put_cut(text, field);
}

template <std::size_t Size>
bool is_text(const std::array<char, Size>& field) {
    return field.front() != '\0' && field.back() == '\0';
}

}  // namespace

GuardianOpening guardian_opening(const GpioRequest& request) {
    if (request.lines.size() > GuardianOpening::most_lines)
        throw InputError(fmt::format("{} GPIO lines; a guardian holds at most {}", request.lines.size(),
                                     GuardianOpening::most_lines),
                         "use a decoder, or the USB lamp controller");
    GuardianOpening opening;
    put_whole(request.chip, opening.chip);
    for (const GpioLine& line : request.lines) {
        GuardianOpening::Line& place = opening.line.at(opening.lines++);
        put_whole(line.line, place.name);
        place.active_low = line.active_low ? 1 : 0;
    }
    return opening;
}

std::optional<GpioRequest> request_in(const GuardianOpening& opening) {
    if (opening.lines == 0 || opening.lines > GuardianOpening::most_lines || !is_text(opening.chip))
        return std::nullopt;
    GpioRequest request{.chip = opening.chip.data(), .lines = {}};
    for (std::size_t i = 0; i < opening.lines; ++i) {
        const GuardianOpening::Line& line = opening.line.at(i);
        if (!is_text(line.name) || line.active_low > 1) return std::nullopt;
        request.lines.push_back({line.name.data(), line.active_low == 1});
    }
    return request;
}

GuardianReply guardian_refusal(const std::string& what, const std::string& hint) {
    GuardianReply reply{.failed = 1};
    put_cut(what, reply.what);
    put_cut(hint, reply.hint);
    return reply;
}

}  // namespace darkbox
