#include "rig/description/retention_section.h"

namespace darkbox {

RetentionRules read_retention(TomlSection& section) {
    section.allow({"keep_days", "keep_newest", "free_gb"});
    RetentionRules rules;
    const auto days = section.integer("keep_days", {1, 36'500});
    if (!days)
        section.fail("keep_days", "has no keep_days", "say for how many days sessions stay at least: keep_days = 90");
    rules.keep_days = static_cast<int>(*days);
    rules.keep_newest = static_cast<int>(section.integer("keep_newest", {0, 1'000'000}).value_or(0));
    rules.free_gb = section.number("free_gb", {0.001, 1e6});
    return rules;
}

}  // namespace darkbox
