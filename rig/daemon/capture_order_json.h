#pragma once

#include <string>

#include "rig/daemon/job.h"

namespace darkbox {

/// The body of POST captures. Strict: throws InputError for what is not JSON, unknown keys, wrong types, long strings.
CaptureOrder parse_capture_order(const std::string& body);

/// The body that makes this order.
nlohmann::json to_json(const CaptureOrder& order);

}  // namespace darkbox
