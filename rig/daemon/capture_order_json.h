#pragma once

#include <string>

#include "rig/capture/light_by_hand.h"
#include "rig/daemon/job.h"

namespace darkbox {

/// A request's body. Throws InputError for what is not one JSON object.
nlohmann::json parse_object(const std::string& body);

/// The body of POST captures. Strict: throws InputError for unknown keys, wrong types, long strings.
CaptureOrder capture_order_from(const nlohmann::json& body);

/// The body of POST lamps/on. Strict as well; throws what light_by_hand() throws.
HandLight hand_light_from(const nlohmann::json& body, const RigDescription& rig);

/// The body of POST jobs: {"kind": …} and what the kind takes. Strict as well.
Job job_from(const nlohmann::json& body);

/// The body that makes this order.
nlohmann::json to_json(const CaptureOrder& order);

}  // namespace darkbox
