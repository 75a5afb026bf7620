#include "processing/calibration/reflect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace darkbox {
namespace {

const Ball big_ball{100, 80, 50, 1.0};

TEST(ReflectAt, CentreOfTheBallMirrorsTheCamera) {
    EXPECT_LT(angle_deg(reflect_at(big_ball, 100, 80).value(), {0, 0, 1}), 1e-9);
}

TEST(ReflectAt, TurnsTwiceAsFarAsTheNormal) {
    // The common mistake is to return the normal: it would lie at 22.5 degrees here, and the object look stretched.
    const double slant = 22.5 * std::numbers::pi / 180;
    const auto light = reflect_at(big_ball, 100 + 50 * std::sin(slant), 80).value();
    EXPECT_LT(angle_deg(light, Eigen::Vector3d(1, 0, 1).normalized()), 1e-9);
}

TEST(ReflectAt, HighlightAboveTheCentreComesFromAbove) {
    EXPECT_GT(reflect_at(big_ball, 100, 60).value().y(), 0.5);  // v runs down, y up
    EXPECT_LT(reflect_at(big_ball, 80, 80).value().x(), -0.5);
}

TEST(ReflectAt, NoDirectionOutsideTheBall) { EXPECT_FALSE(reflect_at(big_ball, 151, 80)); }

TEST(HighlightOf, IsTheInverse) {
    const Eigen::Vector3d light = Eigen::Vector3d(0.4, -0.5, 0.6).normalized();
    const auto at = highlight_of(big_ball, light).value();
    EXPECT_LT(angle_deg(reflect_at(big_ball, at.x, at.y).value(), light), 1e-9);
    EXPECT_FALSE(highlight_of(big_ball, {0, 0, -1}));
}

const ViewGeometry orthographic{0.25, {120, 90}};
const ViewGeometry perspective_view{0.25, {120, 90}, 800};
const MirrorSphere near_sphere{{-30, 12, 4}, 18};

TEST(ReflectAtSphere, IsTheThesisMethodWhenOrthographic) {
    const Ball outline = outline_of(orthographic, near_sphere);
    for (const cv::Point2d at : {cv::Point2d(0, 0), cv::Point2d(20, -31), cv::Point2d(-40, 5)}) {
        const auto thesis = reflect_at(outline, outline.x + at.x, outline.y + at.y).value();
        const auto ray = reflect_at(orthographic, near_sphere, {outline.x + at.x, outline.y + at.y}).value();
        EXPECT_LT(angle_deg(ray.direction, thesis), 1e-9);
        EXPECT_NEAR((ray.point_mm - near_sphere.centre_mm).norm(), 18, 1e-9);
    }
    EXPECT_FALSE(reflect_at(orthographic, near_sphere, {outline.x + outline.radius + 0.1, outline.y}));
}

TEST(ReflectAtSphere, PerspectiveReflectsTheViewRay) {
    // The law of reflection itself: the normal halves the angle between the ways to the camera and to the lamp.
    const cv::Point2d at = perspective_view.project(near_sphere.centre_mm) + cv::Point2d(20, 15);
    const auto ray = reflect_at(perspective_view, near_sphere, at).value();
    const Eigen::Vector3d normal = (ray.point_mm - near_sphere.centre_mm).normalized();
    const Eigen::Vector3d view = (Eigen::Vector3d(0, 0, 800) - ray.point_mm).normalized();
    EXPECT_LT(angle_deg(normal, (view + ray.direction).normalized()), 1e-9);
    EXPECT_LT(cv::norm(perspective_view.project(ray.point_mm) - at), 1e-9);
}

TEST(ReflectAtSphere, OrthographicIsTheLimit) {
    const ViewGeometry far{0.25, {120, 90}, 1e9};
    const auto a = reflect_at(far, near_sphere, {10, 50}).value(),
               b = reflect_at(orthographic, near_sphere, {10, 50}).value();
    EXPECT_LT(angle_deg(a.direction, b.direction), 1e-5);
}

TEST(HighlightOfSphere, IsTheInverseForAnyCameraAndLamp) {
    const Eigen::Vector3d direction = Eigen::Vector3d(0.4, -0.5, 0.6).normalized(), place(260, -330, 390);
    for (const ViewGeometry& view : {orthographic, perspective_view}) {
        const auto distant = reflect_at(view, near_sphere, highlight_of(view, near_sphere, direction).value()).value();
        EXPECT_LT(angle_deg(distant.direction, direction), 1e-9);
        const auto near = reflect_at(view, near_sphere, highlight_of_lamp(view, near_sphere, place).value()).value();
        EXPECT_LT(angle_deg(near.direction, (place - near.point_mm).normalized()), 1e-9);
        EXPECT_FALSE(highlight_of_lamp(view, near_sphere, near_sphere.centre_mm + Eigen::Vector3d(1, 2, 3)));
    }
    EXPECT_FALSE(highlight_of(orthographic, near_sphere, {0, 0, -1}));
}

TEST(OutlineOfSphere, IsWhereViewRaysGraze) {
    for (const ViewGeometry& view : {orthographic, perspective_view}) {
        const Ball outline = outline_of(view, near_sphere);
        const BallEllipse ellipse = outline.ellipse.value_or(BallEllipse{outline.radius, outline.radius, 0});
        for (double turn = 0; turn < 6; turn += 0.5) {
            const double a = std::cos(turn), b = std::sin(turn);
            const cv::Point2d along(std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)),
                across(-along.y, along.x);
            const auto at = [&](double scale) {
                return cv::Point2d(outline.x, outline.y) +
                       scale * (a * ellipse.along * along + b * ellipse.across * across);
            };
            EXPECT_TRUE(reflect_at(view, near_sphere, at(1 - 1e-9)));
            EXPECT_FALSE(reflect_at(view, near_sphere, at(1 + 1e-9)));
        }
    }
    EXPECT_GT(outline_of(perspective_view, near_sphere).ellipse->along,
              outline_of(perspective_view, near_sphere).ellipse->across);
}

TEST(SphereOf, UndoesOutlineOf) {
    const MirrorSphere in_plane{{-30, 12, 0}, 18};
    for (const ViewGeometry& view : {orthographic, perspective_view}) {
        const MirrorSphere back = sphere_of(view, outline_of(view, in_plane));
        EXPECT_LT((back.centre_mm - in_plane.centre_mm).norm(), 1e-6);
        EXPECT_NEAR(back.radius_mm, 18, 1e-6);
    }
    const MirrorSphere back = sphere_of(perspective_view, outline_of(perspective_view, near_sphere), 18.0);
    EXPECT_LT((back.centre_mm - near_sphere.centre_mm).norm(), 1e-6);
}

TEST(MeetingPoint, IsWhereRaysCross) {
    const Eigen::Vector3d lamp(300, 200, 900), a(-80, 0, 0), b(70, 10, 3);
    const auto met = meeting_point({{a, (lamp - a).normalized()}, {b, (lamp - b).normalized()}});
    EXPECT_LT((met.value() - lamp).norm(), 1e-6);
    EXPECT_FALSE(meeting_point({{a, {0, 0, 1}}, {b, {0, 0, 1}}}));
    EXPECT_FALSE(meeting_point({{a, (a - lamp).normalized()}, {b, (b - lamp).normalized()}})) << "behind";
}

}  // namespace
}  // namespace darkbox
