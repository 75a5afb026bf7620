#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rig/cli/command_line.h"
#include "rig/cli/hook.h"

namespace darkbox {

/// Several captures one after the other, such as of an object on a turntable.
struct CaptureSeries {
    std::string object;
    std::optional<Hook> between = {};  ///< runs after every capture but the last
};

/// "vase-001", "vase-002"...: `base` with numbers of three digits, or as many as the count needs.
std::vector<std::filesystem::path> numbered_names(const std::filesystem::path& base, int count);

/// One capture into this new session.
using CaptureInto = std::function<CommandResult(const std::filesystem::path& session)>;

/// Captures into each of the names. The hook finds DARKBOX_SESSION (the session just captured), DARKBOX_NEXT (the one
/// to follow), DARKBOX_CAPTURED, DARKBOX_REPEAT (how many there are, and will be) and DARKBOX_OBJECT in its
/// environment. What a capture or the hook throws ends the series; its message then says where in the series that was.
CommandResult capture_series(const CaptureSeries& series, const std::vector<std::filesystem::path>& names,
                             const CaptureInto& capture, const WorkContext& work);

}  // namespace darkbox
