#pragma once

#include <optional>
#include <string>
#include <vector>

namespace darkbox {

enum class RigVerdict {
    good,
    failed,
    untold,  ///< could not be measured; the words say why
};

/// One thing that was measured.
struct RigFinding {
    std::string what;             ///< "linearity", "flicker", "leak", "focus", "clipping", "movement", "lamp"
    std::string where = {};       ///< the lamp's name; empty: the rig
    std::optional<double> value;  ///< as measured, in `unit`
    std::optional<double> limit;  ///< that decides
    std::string unit = {};
    RigVerdict verdict = RigVerdict::good;
    std::string words = {};   ///< what it means
    std::string remedy = {};  ///< of a failed one
};

struct RigReport {
    std::vector<RigFinding> findings;

    bool good() const;
    /// A line a finding, for people.
    std::string table() const;
    /// What failed, one sentence with its remedy each.
    std::vector<std::string> failures() const;
};

std::string_view name(RigVerdict verdict);

}  // namespace darkbox
