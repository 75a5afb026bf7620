#include "rig/health/rig_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace darkbox {

std::string_view name(RigVerdict verdict) {
    switch (verdict) {
        case RigVerdict::good:
            return "good";
        case RigVerdict::failed:
            return "failed";
        case RigVerdict::untold:
            break;
    }
    return "untold";
}

bool RigReport::good() const {
    return std::none_of(findings.begin(), findings.end(),
                        [](const RigFinding& finding) { return finding.verdict == RigVerdict::failed; });
}

std::string RigReport::table() const {
    std::string text =
        fmt::format("{:<10} {:<12} {:>10} {:>9}  {:<7} {}", "what", "where", "measured", "limit", "verdict", "");
    const auto number = [](const std::optional<double>& value, const std::string& unit) {
        return value ? fmt::format("{:.3g}{}{}", *value, unit.empty() ? "" : " ", unit) : std::string("-");
    };
    for (const RigFinding& f : findings)
        text += fmt::format("\n{:<10} {:<12} {:>10} {:>9}  {:<7} {}", f.what, f.where.empty() ? "-" : f.where,
                            number(f.value, f.unit), number(f.limit, f.unit), name(f.verdict), f.words);
    return text;
}

std::vector<std::string> RigReport::failures() const {
    std::vector<std::string> sentences;
    for (const RigFinding& f : findings)
        if (f.verdict == RigVerdict::failed)
            sentences.push_back(
                fmt::format("{}{}: {}: {}", f.what, f.where.empty() ? "" : " of " + f.where, f.words, f.remedy));
    return sentences;
}

}  // namespace darkbox
