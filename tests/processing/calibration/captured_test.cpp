// Real mirror balls. The psm captures' mask.png files are circles drawn by hand: the matte ball's lies about 1 pixel
// off the outline in its frames, the chrome ball's 1.3 pixels, and lights_reference.txt was read with the latter. So
// two things are tested: with the mask's circle the directions agree with the reference; from the frames alone they
// agree with it but for a common turn of about a degree (docs/decisions/0009).

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/calibration/ball_contour.h"
#include "processing/calibration/ball_search.h"
#include "processing/calibration/calibration.h"
#include "processing/calibration/highlight.h"
#include "processing/calibration/outline.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct Capture {
    std::vector<cv::Mat3f> frames;
    std::vector<std::string> files;
    std::vector<Eigen::Vector3d> reference;
};

cv::Mat3f read_linear(const fs::path& file) {
    const cv::Mat coded = cv::imread(file.string(), cv::IMREAD_COLOR);
    cv::Mat3f frame;
    coded.convertTo(frame, CV_32F, 1 / 255.0);
    cv::cvtColor(frame, frame, cv::COLOR_BGR2RGB);
    return frame;
}

/// Frames named by `name_of`, and as many directions as the file of lights lists.
Capture read_capture(const fs::path& lights, const std::function<fs::path(int)>& name_of) {
    Capture capture;
    std::ifstream in(lights);
    int n = 0;
    in >> n;
    for (int i = 0; i < n; ++i) {
        Eigen::Vector3d direction;
        in >> direction[0] >> direction[1] >> direction[2];
        capture.reference.push_back(direction.normalized());
        capture.files.push_back(name_of(i).filename().string());
        capture.frames.push_back(read_linear(name_of(i)));
    }
    return capture;
}

Capture read_chrome(const fs::path& psm) {
    return read_capture(psm / "lights_reference.txt",
                        [&](int i) { return psm / "chrome" / fmt::format("chrome.{:02}.png", i); });
}

struct Agreement {
    double mean_deg = 0;
    double max_deg = 0;
};

Agreement agreement(const Lights& lights, const std::vector<Eigen::Vector3d>& reference,
                    const Eigen::Matrix3d& reference_from_lights = Eigen::Matrix3d::Identity()) {
    Agreement result;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const double error = angle_deg(reference_from_lights * lights[i].direction, reference[i]);
        result.mean_deg += error / static_cast<double>(lights.size());
        result.max_deg = std::max(result.max_deg, error);
    }
    return result;
}

/// The rotation that takes the lights nearest to the reference (Kabsch 1976).
Eigen::Matrix3d common_turn(const Lights& lights, const std::vector<Eigen::Vector3d>& reference) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < lights.size(); ++i) sum += reference[i] * lights[i].direction.transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
    return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

TEST(CapturedChromeBall, MaskGivesTheReferenceDirections) {
    DARKBOX_NEED_DATA(folder, "psm");
    const Capture capture = read_chrome(folder);
    CalibrationOptions options;
    options.ball_mask = cv::imread((folder / "chrome/mask.png").string(), cv::IMREAD_GRAYSCALE);
    const Calibration calibration = calibrate(capture.frames, capture.files, options);
    const Agreement reached = agreement(calibration.lights, capture.reference);
    fmt::print("chrome with mask: mean {:.3f}, max {:.3f} degrees\n", reached.mean_deg, reached.max_deg);
    EXPECT_LE(reached.mean_deg, 0.3);
    EXPECT_LE(reached.max_deg, 0.5);
}

TEST(CapturedChromeBall, FoundWithoutHelp) {
    DARKBOX_NEED_DATA(folder, "psm");
    const Capture capture = read_chrome(folder);
    const Calibration calibration = calibrate(capture.frames, capture.files);
    const Ball& ball = calibration.balls.at(0);
    const Circle mask = measure_mask(cv::imread((folder / "chrome/mask.png").string(), cv::IMREAD_GRAYSCALE)).circle;
    EXPECT_NEAR(ball.x, mask.x, 1.0);
    EXPECT_NEAR(ball.y, mask.y, 1.5);
    EXPECT_NEAR(ball.radius, mask.radius, 1.0);
    EXPECT_LT(calibration.contour_rms_px, 0.25);
    EXPECT_TRUE(calibration.warnings.empty()) << calibration.warnings.front();

    const Agreement direct = agreement(calibration.lights, capture.reference);
    const Agreement turned =
        agreement(calibration.lights, capture.reference, common_turn(calibration.lights, capture.reference));
    fmt::print("chrome without help: mean {:.3f}, max {:.3f} degrees; but for a common turn {:.3f}, {:.3f}\n",
               direct.mean_deg, direct.max_deg, turned.mean_deg, turned.max_deg);
    EXPECT_LE(direct.mean_deg, 1.2);
    EXPECT_LE(turned.mean_deg, 0.3);
    EXPECT_LE(turned.max_deg, 0.5);
}

double apart_px(const Circle& a, const Circle& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// The matte ball's outline is plain to see all around, and its mask is off it by as much as the chrome ball's is.
TEST(CapturedMatteBall, ItsMaskTooWasDrawnByHand) {
    DARKBOX_NEED_DATA(folder, "psm");
    std::vector<cv::Mat3f> frames;
    for (int i = 0; i < 12; ++i) frames.push_back(read_linear(folder / fmt::format("gray/gray.{:02}.png", i)));
    const Circle mask = measure_mask(cv::imread((folder / "gray/mask.png").string(), cv::IMREAD_GRAYSCALE)).circle;
    const BallContour seen = measure_contour(mean_over_frames(frames), mask);
    fmt::print("gray: mask {:.2f} {:.2f} {:.2f}, frames {:.2f} {:.2f} {:.2f}, support {:.2f}\n", mask.x, mask.y,
               mask.radius, seen.circle.x, seen.circle.y, seen.circle.radius, seen.support);
    EXPECT_GT(seen.support, 0.8);
    EXPECT_GT(apart_px(seen.circle, mask), 0.6);
}

/// The circle that explains highlights by the directions of their lights: (u, v) = c + r n_xy is linear in it.
Circle circle_of(const std::vector<HighlightReading>& highlights, const std::vector<Eigen::Vector3d>& lights) {
    const auto rows = static_cast<Eigen::Index>(2 * lights.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows, 3);
    Eigen::VectorXd b(rows);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Eigen::Vector3d normal = (lights[i] + Eigen::Vector3d(0, 0, 1)).normalized();
        const auto row = static_cast<Eigen::Index>(2 * i);
        a.row(row) << 1, 0, normal.x();
        a.row(row + 1) << 0, 1, -normal.y();
        b[row] = highlights[i].highlight.value().u;
        b[row + 1] = highlights[i].highlight.value().v;
    }
    const Eigen::Vector3d circle = a.colPivHouseholderQr().solve(b);
    const double rms = std::sqrt((a * circle - b).squaredNorm() / static_cast<double>(rows));
    fmt::print("sheep: circle of the lights {:.2f} {:.2f} {:.2f}, {:.2f} px rms\n", circle[0], circle[1], circle[2],
               rms);
    EXPECT_LT(rms, 0.25);
    return {circle[0], circle[1], circle[2]};
}

// A ball of 19 pixels cut by the border, on a stand that mirrors in it. Its highlights are read, and it is told from
// all else in the picture; its outline is not found yet: the stand's lower edge draws the circle 5 pixels down.
TEST(CapturedSheep, OneBallIsFoundAndItsHighlightsAreRead) {
    DARKBOX_NEED_DATA(folder, "sheep_mirrorball");
    const Capture capture =
        read_capture(folder / "lights.txt", [&](int i) { return folder / fmt::format("sheep.{}.png", i); });
    const auto readings = find_highlights(capture.frames, {306.9, 342.8, 19.4, 1});
    const Circle circle = circle_of(readings, capture.reference);
    Lights lights(capture.reference.size());
    for (std::size_t i = 0; i < lights.size(); ++i)
        lights[i].direction =
            reflect_at({circle.x, circle.y, circle.radius, 1}, readings[i].highlight->u, readings[i].highlight->v)
                .value();
    const Agreement reached = agreement(lights, capture.reference);
    const auto balls = find_balls(capture.frames);
    ASSERT_EQ(balls.size(), 1U);
    fmt::print("sheep: with that circle mean {:.2f}, max {:.2f} degrees; found {:.2f} {:.2f} {:.2f}\n",
               reached.mean_deg, reached.max_deg, balls[0].x, balls[0].y, balls[0].radius);
    EXPECT_LT(reached.mean_deg, 1.6);
    EXPECT_LT(apart_px({balls[0].x, balls[0].y, balls[0].radius}, circle), 6);
    EXPECT_NEAR(balls[0].radius, circle.radius, 1);
    const Calibration calibration = calibrate(capture.frames, capture.files);
    ASSERT_FALSE(calibration.warnings.empty());
    EXPECT_NE(calibration.warnings.front().find("could not be measured"), std::string::npos);
}

}  // namespace
}  // namespace darkbox
