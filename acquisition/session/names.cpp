#include <fmt/format.h>

#include <array>
#include <chrono>
#include <ctime>
#include <utility>

#include "acquisition/session/session.h"

namespace darkbox {
namespace {

constexpr std::array<std::pair<FrameKind, std::string_view>, 5> frame_kinds{{
    {FrameKind::lit, "lit"},
    {FrameKind::dark, "dark"},
    {FrameKind::ambient, "ambient"},
    {FrameKind::flat, "flat"},
    {FrameKind::ball, "ball"},
}};

constexpr std::array<std::pair<TransferCurve, std::string_view>, 2> transfer_curves{{
    {TransferCurve::linear, "linear"},
    {TransferCurve::srgb, "srgb"},
}};

template <typename Table>
auto value_named(const Table& table, std::string_view wanted) -> std::optional<typename Table::value_type::first_type> {
    for (const auto& [value, text] : table)
        if (text == wanted) return value;
    return std::nullopt;
}

}  // namespace

std::string_view name(FrameKind kind) { return frame_kinds[static_cast<std::size_t>(kind)].second; }
std::string_view name(TransferCurve curve) { return transfer_curves[static_cast<std::size_t>(curve)].second; }
std::optional<FrameKind> frame_kind_from_name(std::string_view name) { return value_named(frame_kinds, name); }
std::optional<TransferCurve> transfer_curve_from_name(std::string_view name) {
    return value_named(transfer_curves, name);
}

std::string iso8601_now() {
    using namespace std::chrono;
    const auto now = time_point_cast<milliseconds>(system_clock::now());
    const std::time_t seconds = system_clock::to_time_t(floor<std::chrono::seconds>(now));
    std::tm utc{};
    ::gmtime_r(&seconds, &utc);
    return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                       utc.tm_hour, utc.tm_min, utc.tm_sec, now.time_since_epoch().count() % 1000);
}

}  // namespace darkbox
