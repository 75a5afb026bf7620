#include "rig/capture/light_by_hand.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"

namespace darkbox {
namespace {

constexpr double share_of_max_on = 0.9;
constexpr const char* session_of_hand_light = "lit by hand";

using Look = std::function<void()>;

/// Ends early when asked to stop.
void wait_lit(Seconds time, Clock& clock, const WorkContext& work, const Look& look) {
    constexpr auto step = std::chrono::milliseconds(20);
    const TimePoint end = clock.now() + to_nanoseconds(time);
    while (!work.cancelled() && clock.now() < end) {
        clock.sleep_until(std::min(end, clock.now() + step));
        look();
    }
}

void burn_for(const HandLight& light, LampArray& lamps, Clock& clock, const WorkContext& work, const Look& look) {
    if (work.cancelled()) throw Cancelled("the lamp was not lit: cancelled before it began", "ask for it again");
    lamps.light(light.lamp, 1.0);
    wait_lit(light.time, clock, work, look);
    lamps.dark();
}

}  // namespace

std::string account_of(const RigDescription& rig) { return "rig " + rig.name; }

HandLight light_by_hand(const RigDescription& rig, const std::string& lamp, std::optional<Seconds> time,
                        const std::string& object) {
    const auto found = std::ranges::find(rig.lamps, lamp, &LampDescription::name);
    if (found == rig.lamps.end())
        throw InputError(fmt::format("there is no lamp '{}'", lamp), "darkbox lamps list names them");
    const Seconds most = found->max_on * share_of_max_on;
    const Seconds wanted = time.value_or(most);
    if (!(wanted > Seconds(0) && wanted <= most))
        throw InputError(
            fmt::format("'{}' is to be lit for {} s; allowed: above 0 to {:.3g}, nine tenths of its max_on_s", lamp,
                        wanted.count(), most.count()),
            "light it for a shorter time");
    return {LampId{static_cast<std::uint32_t>(found - rig.lamps.begin())}, wanted, object};
}

void shine(const HandLight& light, const RigDescription& description, LampArray& lamps, Clock& clock,
           const std::filesystem::path& sessions, const WorkContext& work, const Look& look) {
    const DarkOnExit dark_on_exit(lamps);
    if (!knows_doses(description)) return burn_for(light, lamps, clock, work, look);
    RigDescription rig = description;
    rig.dose.exempt.push_back(account_of(rig));
    const std::string object = light.object.empty() ? account_of(rig) : light.object;
    DoseBook book(sessions);
    const LightDose whole = over(rig.lamps.at(light.lamp.value).dose_per_s, light.time);
    require_dose(rig.dose, object, book.spent(object), {}, whole);
    DosedLamps dosed(lamps, clock, rig, book, object, session_of_hand_light);
    burn_for(light, dosed, clock, work, look);
    dosed.finish();
}

}  // namespace darkbox
