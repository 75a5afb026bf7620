#pragma once

#include <optional>

#include "rig/lamps/lamp_array.h"

namespace darkbox::test {

/// Lamps for scripted cameras, which look at the one that is lit.
class TwoLamps final : public LampArray {
public:
    std::size_t size() const override { return 2; }
    void light(LampId lamp, double) override { lit = lamp; }
    void dark() override { lit.reset(); }
    LampHealth health() override { return {}; }

    std::optional<LampId> lit;
};

}  // namespace darkbox::test
