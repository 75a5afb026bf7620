#include "processing/maps/lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

Light toward(double x, double y, double z) {
    Light light;
    light.file = "frame.png";
    light.direction = Eigen::Vector3d(x, y, z).normalized();
    return light;
}

TEST(RequireSolvable, ThreeIndependentLightsAreEnough) {
    EXPECT_NO_THROW(require_solvable({toward(1, 0, 1), toward(-1, 1, 1), toward(0, -1, 1)}));
}

TEST(RequireSolvable, TwoUsedLightsAreTooFew) {
    Lights lights{toward(1, 0, 1), toward(-1, 1, 1), toward(0, -1, 1)};
    lights[1].used = false;
    EXPECT_THROW(require_solvable(lights), InputError);
}

TEST(RequireSolvable, CoplanarLightsHaveNoSolution) {
    EXPECT_THROW(require_solvable({toward(-1, 0, 1), toward(0, 0, 1), toward(1, 0, 1), toward(2, 0, 1)}), InputError);
}

TEST(RequireSolvable, DirectionThatIsNotANumberIsNamed) {
    Lights lights{toward(1, 0, 1), toward(-1, 1, 1), toward(0, -1, 1)};
    lights[2].direction.x() = std::nan("");
    lights[2].file = "bad.png";
    try {
        require_solvable(lights);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("bad.png"), std::string::npos);
    }
}

TEST(ConditionNumber, OrthogonalLightsAreBest) {
    EXPECT_NEAR(condition_number({toward(1, 0, 0), toward(0, 1, 0), toward(0, 0, 1)}), 1.0, 1e-12);
}

TEST(AngleDeg, IsExactForTinyAngles) {
    EXPECT_NEAR(angle_deg({0, 0, 1}, Eigen::Vector3d(1e-9, 0, 1)), 1e-9 * 57.29577951308232, 1e-15);
}

}  // namespace
}  // namespace darkbox
