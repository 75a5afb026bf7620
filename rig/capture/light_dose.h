#pragma once

#include <string>
#include <vector>

#include "acquisition/frame/error.h"
#include "rig/description/rig_description.h"

namespace darkbox {

LightDose& operator+=(LightDose& sum, const LightDose& more);
/// What a rate of so much in a second comes to.
LightDose over(const LightDose& per_second, Seconds lit);

/// More light than an object may be given: not tried again, the session stays as it is.
class DoseExceeded : public Error {
public:
    using Error::Error;
    ~DoseExceeded() override;
};

/// Whether the rig's lamps say what they do to an object, so that there is something to count.
bool knows_doses(const RigDescription& rig);

/// Throws DoseExceeded, naming object, budget and what was spent, when `spent` of the object and `in_capture` of this
/// capture leave no room for `more`. Objects that [dose] exempts pass.
void require_dose(const DoseDescription& limits, const std::string& object, const LightDose& spent,
                  const LightDose& in_capture, const LightDose& more);

}  // namespace darkbox
