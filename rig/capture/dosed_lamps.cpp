#include "rig/capture/dosed_lamps.h"

#include <algorithm>
#include <utility>

#include "rig/capture/light_dose.h"

namespace darkbox {
namespace {

/// Light that may be in no book yet while the lamps are dark: what a crash loses at most, besides the lamp that burns.
constexpr Seconds kept_every{1.0};

}  // namespace

DosedLamps::DosedLamps(LampArray& lamps, Clock& clock, const RigDescription& rig, DoseBook& book, std::string object,
                       std::string session, const LightDose& before)
    : lamps_(lamps),
      clock_(clock),
      rig_(rig),
      book_(book),
      object_(std::move(object)),
      session_(std::move(session)),
      given_(before) {}

DosedLamps::~DosedLamps() {
    try {
        dark();
    } catch (...) {  // NOLINT(bugprone-empty-catch): whoever lent the lamps darkens them as well
    }
    try {
        keep();
    } catch (...) {  // NOLINT(bugprone-empty-catch): finish() is what tells
    }
}

LightDose DosedLamps::at_least(LampId lamp, double level) const {
    const LampDescription& described = rig_.lamps.at(lamp.value);
    return over(described.dose_per_s, level * (described.settle + rig_.camera.exposure));
}

void DosedLamps::burn(const std::optional<StrobeStep>& next, TimePoint from) {
    if (burning_) {
        const Seconds lit = from - since_;
        const LightDose dose = over(rig_.lamps.at(burning_->lamp->value).dose_per_s, burning_->level * lit);
        given_ += dose;
        unkept_ += dose;
        unkept_time_ += lit;
    }
    burning_ = next && next->lamp ? next : std::nullopt;
    since_ = from;
}

void DosedLamps::light(LampId lamp, double level) {
    see_steps();
    program_.clear();
    burn(std::nullopt, clock_.now());
    LightDose spent = book_.spent(object_);
    spent += unkept_;
    try {
        require_dose(rig_.dose, object_, spent, given_, at_least(lamp, level));
    } catch (...) {
        lamps_.dark();
        throw;
    }
    const TimePoint from = clock_.now();
    burn(StrobeStep{lamp, level}, from);  // before the switch: a lamp that fails to answer may burn
    lamps_.light(lamp, level);
}

void DosedLamps::dark() {
    see_steps();
    program_.clear();
    lamps_.dark();
    burn(std::nullopt, clock_.now());
    if (unkept_time_ >= kept_every) keep();
}

void DosedLamps::arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) {
    dark();
    LightDose spent = book_.spent(object_);
    spent += unkept_;
    LightDose more;
    for (const StrobeStep& step : program)
        if (step.lamp) more += at_least(*step.lamp, step.level);
    require_dose(rig_.dose, object_, spent, given_, more);
    program_ = program;
    events_.clear();
    lamps_.strobed()->arm(program, exposed);
}

void DosedLamps::see_steps() {
    if (program_.empty()) return;
    for (const StrobeEvent& event : lamps_.strobed()->take_events()) {
        burn(event.step < program_.size() ? std::optional(program_[event.step]) : std::nullopt, event.moment.begin);
        events_.push_back(event);
    }
}

std::vector<StrobeEvent> DosedLamps::take_events() {
    see_steps();
    return std::exchange(events_, {});
}

void DosedLamps::require_room_for(const std::vector<LampId>& lamps) const {
    LightDose more;
    for (const LampId lamp : lamps) more += at_least(lamp, 1.0);
    require_dose(rig_.dose, object_, book_.spent(object_), given_, more);
}

void DosedLamps::keep() {
    if (!(unkept_time_ > Seconds(0))) return;
    book_.add(object_, session_, unkept_);
    unkept_ = {};
    unkept_time_ = Seconds(0);
}

void DosedLamps::finish() {
    dark();
    if (!(given_.lux_s > 0 || given_.uv_j_per_m2 > 0 || given_.ir_j_per_m2 > 0)) return;
    keep();
    book_.flush();
}

}  // namespace darkbox
