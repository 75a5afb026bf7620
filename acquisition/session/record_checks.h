#pragma once

#include <string>
#include <string_view>

#include "acquisition/session/session.h"

namespace darkbox {

/// The one schema this program reads and writes.
inline constexpr int session_schema = 1;

/// What may stand in a session, whoever wrote it. Each throws InputError that begins with `where` and names the field,
/// the value and what is allowed.

/// A path below data/: relative, UTF-8, no empty or hidden component (so no "." or ".."), components of at most 255
/// bytes and 1024 in all, not "session.json".
void require_payload_name(const std::string& where, const std::string& name);

void require_sha256(const std::string& where, std::string_view hex);

void require_valid(const std::string& where, const CaptureGeometry& geometry);
void require_valid(const std::string& where, const SessionInfo& info);

/// Everything about a record but its checksum.
void require_valid(const std::string& where, const FrameRecord& record);

bool is_utf8(std::string_view text);

/// A value from outside for a message: shortened, and safe to print.
std::string shown(std::string_view text);

}  // namespace darkbox
