#pragma once

#include <optional>

namespace darkbox {

/// [retention] of rig.toml: which sessions darkboxd may remove. Without it none is ever removed.
struct RetentionRules {
    int keep_days = 0;                   ///< younger sessions stay
    int keep_newest = 0;                 ///< as many of the newest stay, however old
    std::optional<double> free_gb = {};  ///< removes only while less is free on the disk, 1e9 bytes; none: by age alone
};

}  // namespace darkbox
