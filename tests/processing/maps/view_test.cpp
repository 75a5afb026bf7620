#include "processing/maps/view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "processing/maps/lights.h"

namespace darkbox {
namespace {

TEST(ViewGeometry, OrthographicPixelsAreMillimetresWithYUp) {
    const ViewGeometry view{0.5, {100, 80}};
    EXPECT_TRUE(view.point_at({104, 70}, 7).isApprox(Eigen::Vector3d(2, 5, 7)));
    EXPECT_TRUE(view.to_camera({2, 5, 7}).isApprox(Eigen::Vector3d(0, 0, 1)));
}

TEST(ViewGeometry, PerspectivePointsLieOnTheRayThroughTheCamera) {
    const ViewGeometry view{0.5, {100, 80}, 800};
    const Eigen::Vector3d near = view.point_at({140, 20}, 100), far = view.point_at({140, 20}, -50);
    const Eigen::Vector3d camera(0, 0, 800);
    EXPECT_LT((near - camera).normalized().cross((far - camera).normalized()).norm(), 1e-12);
    EXPECT_TRUE(view.to_camera(near).isApprox((camera - near).normalized()));
}

TEST(ViewGeometry, ProjectUndoesPointAt) {
    for (const double distance : {800.0, std::numeric_limits<double>::infinity()}) {
        const ViewGeometry view{0.5, {100, 80}, distance};
        const cv::Point2d seen = view.project(view.point_at({140, 20}, 33));
        EXPECT_NEAR(seen.x, 140, 1e-9);
        EXPECT_NEAR(seen.y, 20, 1e-9);
    }
}

TEST(Incidence, ANearLightFallsOffWithTheSquareOfItsDistance) {
    Light light;
    light.near = LampPosition{{0, 0, 1000}, {0, 0, 0}};
    const Incidence at = incidence(light, {0, 0, 500});
    EXPECT_NEAR(at.falloff, 4, 1e-12);
    EXPECT_TRUE(at.direction.isApprox(Eigen::Vector3d(0, 0, 1)));
}

TEST(HeldAt, ALampIsSeenFromElsewhereAndItsCovarianceFollows) {
    Light light;
    light.near = LampPosition{{0, 0, 1000}, {0, 0, 0}, 4 * Eigen::Matrix3d::Identity()};
    const Light there = held_at(light, {0, 600, 200});
    EXPECT_TRUE(there.direction.isApprox(Eigen::Vector3d(0, -0.6, 0.8)));
    EXPECT_TRUE(there.intensity.isApprox(Eigen::Vector3d::Ones()));  // as far away as before
    EXPECT_NEAR(there.sigma_deg(), 2 / 1000.0 * 180 / M_PI, 1e-9);
    EXPECT_NEAR((there.covariance * there.direction).norm(), 0, 1e-15);
    EXPECT_EQ(held_at(Light{}, {1, 2, 3}).direction, Light{}.direction);
}

TEST(Incidence, ADistantLightIsTheSameEverywhere) {
    Light light;
    light.direction = Eigen::Vector3d(1, 2, 3).normalized();
    EXPECT_EQ(incidence(light, {500, -20, 3}).direction, light.direction);
    EXPECT_EQ(incidence(light, {500, -20, 3}).falloff, 1);
}

}  // namespace
}  // namespace darkbox
