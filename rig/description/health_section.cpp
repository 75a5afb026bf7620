#include "rig/description/health_section.h"

#include <fmt/format.h>

namespace darkbox {

HealthDescription read_health(TomlSection& section, const std::string& lamps_driver) {
    section.allow({"warm_up", "warm_up_s", "steady_level", "hottest_c"});
    HealthDescription health;
    const std::string rule = section.text("warm_up").value_or("");
    if (rule == "wait") health.warm_up = WarmUpRule::wait;
    if (rule == "warn") health.warm_up = WarmUpRule::warn;
    if (rule == "refuse") health.warm_up = WarmUpRule::refuse;
    if (section.has("warm_up") && health.warm_up == WarmUpRule::none)
        section.fail("warm_up", fmt::format("has warm_up = \"{}\"", rule), "write \"wait\", \"warn\" or \"refuse\"");
    if (section.has("warm_up_s") && health.warm_up != WarmUpRule::wait)
        section.fail("warm_up_s", "has warm_up_s, but nothing that waits", "add warm_up = \"wait\", or remove it");
    if (section.has("steady_level") && health.warm_up == WarmUpRule::none)
        section.fail("steady_level", "has steady_level without warm_up", "add warm_up = \"wait\", or remove it");
    health.warm_up_longest = Seconds(section.number("warm_up_s", {10, 7200}).value_or(health.warm_up_longest.count()));
    health.steady_level = section.number("steady_level", {1e-6, 0.1}).value_or(health.steady_level);
    health.hottest_c = section.number("hottest_c", {20, 120});
    if (health.hottest_c && lamps_driver == "gpio")
        section.fail("hottest_c", "has hottest_c, but \"gpio\" lamps have no thermometer", "remove it");
    return health;
}

}  // namespace darkbox
