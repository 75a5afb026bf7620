#pragma once

#include <map>
#include <string>
#include <vector>

#include "acquisition/device/clock.h"
#include "rig/capture/dose_book.h"
#include "rig/lamps/lamp_array.h"
#include "rig/lamps/strobed_lamps.h"

namespace darkbox {

/// Lamps whose light on an object is counted, from switch to switch, whatever it is for: frames, tries that failed,
/// previews. Refuses a lamp whose light would be too much. Thread-compatible.
class DosedLamps final : public LampArray, public StrobedLamps {
public:
    /// All references must outlive this. `before`: what the capture gave already and the book knows.
    DosedLamps(LampArray& lamps, Clock& clock, const RigDescription& rig, DoseBook& book, std::string object,
               std::string session, const LightDose& before = {});
    DosedLamps(const DosedLamps&) = delete;
    DosedLamps& operator=(const DosedLamps&) = delete;
    /// Keeps what is not kept yet, as far as the disk takes it.
    ~DosedLamps() override;

    std::size_t size() const override { return lamps_.size(); }
    /// Throws DoseExceeded, with the lamps dark, and what the lamps throw.
    void light(LampId lamp, double level) override;
    void dark() override;
    LampHealth health() override { return lamps_.health(); }
    StrobedLamps* strobed() override { return lamps_.strobed() ? this : nullptr; }
    void arm(const std::vector<StrobeStep>& program, Nanoseconds exposed) override;
    std::vector<StrobeEvent> take_events() override;

    /// Throws DoseExceeded when lighting each of these once is more than is left.
    void require_room_for(const std::vector<LampId>& lamps) const;
    /// Keeps it all, so that power loss takes nothing back. Throws DeviceError.
    void finish();
    /// What this capture gave so far.
    const LightDose& given() const { return given_; }

private:
    LightDose at_least(LampId lamp, double level) const;
    void burn(const std::optional<StrobeStep>& next, TimePoint from);
    void see_steps();
    void keep();

    LampArray& lamps_;
    Clock& clock_;
    const RigDescription& rig_;
    DoseBook& book_;
    const std::string object_;
    const std::string session_;
    std::optional<StrobeStep> burning_;  ///< one with a lamp
    TimePoint since_;
    std::vector<StrobeStep> program_;
    std::vector<StrobeEvent> events_;  ///< seen here before they were asked for
    LightDose given_;
    LightDose unkept_;
    Seconds unkept_time_{0};
};

}  // namespace darkbox
