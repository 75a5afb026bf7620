#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace darkbox {

/// A lamp by its place in the rig description, counted from 0.
struct LampId {
    std::uint32_t value = 0;
    friend auto operator<=>(const LampId&, const LampId&) = default;
};

/// A frame by its place in a session's manifest, counted from 0.
struct FrameIndex {
    std::uint32_t value = 0;
    friend auto operator<=>(const FrameIndex&, const FrameIndex&) = default;
};

}  // namespace darkbox

template <>
struct std::hash<darkbox::LampId> {
    std::size_t operator()(darkbox::LampId id) const noexcept { return std::hash<std::uint32_t>{}(id.value); }
};
