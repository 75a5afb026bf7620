#include "sim/faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <regex>
#include <sstream>
#include <string_view>

#include "acquisition/frame/error.h"

namespace darkbox::sim {
namespace {

struct Row {
    FaultKind kind;
    std::string_view name;
    int lamps;
    double most = 0.0;  ///< the largest amount; 0: it takes none
};
constexpr std::array fault_table{Row{FaultKind::drop, "drop", 0},
                                 Row{FaultKind::error_flag, "error-flag", 0},
                                 Row{FaultKind::repeat, "repeat", 0},
                                 Row{FaultKind::stale_queue, "stale-queue", 0},
                                 Row{FaultKind::black_frame, "black-frame", 0},
                                 Row{FaultKind::hang, "hang", 0},
                                 Row{FaultKind::dead_lamp, "dead-lamp", 1},
                                 Row{FaultKind::stuck_lamp, "stuck-lamp", 1},
                                 Row{FaultKind::swapped_lamps, "swapped-lamps", 2},
                                 Row{FaultKind::sequence_wrap, "sequence-wrap", 0},
                                 Row{FaultKind::unplug, "unplug", 0},
                                 Row{FaultKind::door_open, "door-open", 0},
                                 Row{FaultKind::leaking_lamp, "leaking-lamp", 2, 1.0},
                                 Row{FaultKind::dim_lamp, "dim-lamp", 1, 1.0},
                                 Row{FaultKind::pwm, "pwm", 0, 1e6},
                                 Row{FaultKind::nonlinear, "nonlinear", 0, 0.2},
                                 Row{FaultKind::defocus, "defocus", 0, 20.0},
                                 Row{FaultKind::camera_knock, "camera-knock", 0, 20.0},
                                 Row{FaultKind::warming, "warming", 0, 0.2},
                                 Row{FaultKind::hot_lamps, "hot-lamps", 0, 200.0},
                                 Row{FaultKind::failed_write, "failed-write", 0},
                                 Row{FaultKind::full_disk, "full-disk", 0},
                                 Row{FaultKind::object_knock, "object-knock", 0, 20.0}};

[[noreturn]] void throw_bad_fault(const std::string& word) {
    std::string names;
    for (const Row& row : fault_table)
        names += fmt::format("{}{}{}", names.empty() ? "" : ", ", row.name, row.most > 0 ? "=AMOUNT" : "");
    throw InputError(fmt::format("cannot read the simulated fault '{}'", word),
                     fmt::format("write NAME@MOMENT, NAME@MOMENTxCOUNT or, for lamps, NAME@MOMENT:LAMP[,LAMP], with "
                                 "=AMOUNT at the end where there is one; names: {}",
                                 names));
}

Fault parse_fault(const std::string& word) {
    static const std::regex form(
        R"(([a-z-]+)@(\d{1,9})(?:x(\d{1,9}))?(?::(\d{1,4})(?:,(\d{1,4}))?)?(?:=(\d{1,7}(?:\.\d{1,9})?))?)");
    std::smatch part;
    if (!std::regex_match(word, part, form)) throw_bad_fault(word);
    const auto row =
        std::find_if(fault_table.begin(), fault_table.end(), [&](const Row& r) { return r.name == part[1].str(); });
    const int lamps = part[5].matched ? 2 : part[4].matched ? 1 : 0;
    if (row == fault_table.end() || row->lamps != lamps || part[6].matched != (row->most > 0)) throw_bad_fault(word);
    Fault fault{row->kind, std::stoull(part[2]), part[3].matched ? std::stoull(part[3]) : 1, {}, {}, 0.0};
    if (lamps > 0) fault.lamp.value = static_cast<std::uint32_t>(std::stoul(part[4]));
    if (lamps > 1) fault.other.value = static_cast<std::uint32_t>(std::stoul(part[5]));
    if (part[6].matched) fault.amount = std::stod(part[6]);
    if (row->most > 0 && !(fault.amount > 0 && fault.amount <= row->most)) throw_bad_fault(word);
    return fault;
}

}  // namespace

std::optional<double> FaultPlan::amount(FaultKind kind, std::uint64_t sequence) const {
    std::optional<double> latest;
    for (const Fault& fault : faults)
        if (fault.kind == kind && fault.at <= sequence) latest = fault.amount;
    return latest;
}

bool FaultPlan::hits(FaultKind kind, std::uint64_t sequence) const {
    return std::any_of(faults.begin(), faults.end(), [&](const Fault& fault) {
        return fault.kind == kind && fault.at <= sequence && sequence < fault.at + fault.count;
    });
}

bool changes_what_is_seen(const FaultPlan& plan) {
    return std::any_of(plan.faults.begin(), plan.faults.end(), [](const Fault& fault) {
        return fault.kind == FaultKind::defocus || fault.kind == FaultKind::camera_knock ||
               fault.kind == FaultKind::object_knock;
    });
}

FaultPlan parse_faults(const std::string& text) {
    FaultPlan plan;
    std::istringstream words(text);
    for (std::string word; words >> word;) plan.faults.push_back(parse_fault(word));
    return plan;
}

}  // namespace darkbox::sim
