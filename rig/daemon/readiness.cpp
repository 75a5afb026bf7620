#include "rig/daemon/readiness.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"
#include "rig/health/warm_up.h"

namespace darkbox {
namespace {

constexpr Seconds stays_warm{120};  ///< after it was last at work

}  // namespace

void Readiness::require(const RigDescription& rig, const CaptureDevices& devices, CaptureRequest& request,
                        const WorkContext& work) {
    require_cool(devices.lamps);
    if (rules_.warm_up != WarmUpRule::none) require_warm(rig, devices, request, work);
}

void Readiness::require_cool(LampArray& lamps) const {
    if (!rules_.hottest_c) return;
    const LampHealth health = lamps.health();
    if (!health.temperature_c || *health.temperature_c <= *rules_.hottest_c) return;
    throw InputError(fmt::format("the lamps' heat sink has {:.0f} degrees Celsius; no capture begins above {:.0f}",
                                 *health.temperature_c, *rules_.hottest_c),
                     "let it cool (darkbox rig status shows it); if it stays hot, look at its fan and at max_duty, or "
                     "raise [health] hottest_c");
}

void Readiness::require_warm(const RigDescription& rig, const CaptureDevices& devices, CaptureRequest& request,
                             const WorkContext& work) {
    if (used_ && devices.clock.now() - *used_ < to_nanoseconds(stays_warm)) return;
    WarmUpOptions options;
    options.steady_level = rules_.steady_level;
    options.longest = rules_.warm_up == WarmUpRule::wait ? rules_.warm_up_longest : options.window;
    const WarmUp found = watch_warm_up(rig, devices, options, work);
    const std::string limit = fmt::format("{} (allowed: {:.2g})", found.words(), rules_.steady_level);
    if (found.steady) {
        request.notes.push_back("the camera is warm: " + found.words());
    } else if (rules_.warm_up == WarmUpRule::warn) {
        request.notes.push_back("the camera is not warm yet: " + limit);
    } else if (rules_.warm_up == WarmUpRule::refuse) {
        throw InputError("the camera is not warm yet: " + limit,
                         "try again in some minutes, or let captures wait: [health] warm_up = \"wait\"");
    } else {
        throw InputError("the camera does not get steady: " + limit,
                         "keep the room's light out; raise [health] warm_up_s or steady_level if it needs longer or "
                         "never does");
    }
}

}  // namespace darkbox
