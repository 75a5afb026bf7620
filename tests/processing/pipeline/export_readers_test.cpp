// Exports read back by readers that share nothing with what wrote them: written here from the formats' descriptions,
// and OpenCV's for pictures.

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "processing/formats/light_files.h"
#include "processing/pipeline/export.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const fs::path& file) {
    std::ifstream in(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) lines.push_back(line);
    return lines;
}

Eigen::Vector3d three_numbers(const std::string& line) {
    std::istringstream in(line);
    Eigen::Vector3d numbers(NAN, NAN, NAN);
    in >> numbers.x() >> numbers.y() >> numbers.z();
    return numbers;
}

/// Seven photographs with their lights, one of which cannot be used.
class ExportReaders : public testing::Test {
protected:
    void SetUp() override {
        lights_ = test::lamp_ring();
        for (std::size_t i = 0; i < lights_.size(); ++i) lights_[i].file = "frame" + std::to_string(i + 1) + ".png";
        test::write_photographs(at("photos"), lights_);
        write_lp(at("photos/ring.lp"), lights_);
        ImportOptions options;
        options.folders = {at("photos")};
        options.out = at("session");
        session_.emplace(import_photographs(options));
        CalibrateOptions calibrate;
        calibrate.calibration.drop = {"frame3.png"};
        run_calibrate(*session_, calibrate);
        lights_.erase(lights_.begin() + 2);
    }
    fs::path at(const std::string& name) const { return folder_.path() / name; }

    test::TemporaryFolder folder_;
    Lights lights_;  ///< those that can be used
    std::optional<Session> session_;
};

/// A line with the count, then a line for each: name, x, y, z.
TEST_F(ExportReaders, LightPositionsOfReflectanceTransformationImaging) {
    export_session(*session_, ExportFormat::lp, at("out.lp"));
    const auto lines = lines_of(at("out.lp"));
    ASSERT_EQ(lines.size(), lights_.size() + 1);
    EXPECT_EQ(std::stoul(lines.front()), lights_.size());
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        const std::string& line = lines[i + 1];
        const auto space = line.find(' ');
        EXPECT_EQ(line.substr(0, space), lights_[i].file);
        EXPECT_LE((three_numbers(line.substr(space)) - lights_[i].direction).norm(), 1e-5);
    }
}

/// filenames.txt, and a line for each name in light_directions.txt and light_intensities.txt; mask.png; pictures of 16
/// bits, linear, that are divided by the intensities.
TEST_F(ExportReaders, DiLiGenT) {
    export_session(*session_, ExportFormat::diligent, at("set"));
    const auto names = lines_of(at("set/filenames.txt"));
    const auto directions = lines_of(at("set/light_directions.txt"));
    const auto intensities = lines_of(at("set/light_intensities.txt"));
    ASSERT_EQ(names.size(), lights_.size());
    ASSERT_EQ(directions.size(), lights_.size());
    ASSERT_EQ(intensities.size(), lights_.size());
    const cv::Mat mask = cv::imread((at("set") / "mask.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(mask.size(), cv::Size(96, 80));
    EXPECT_EQ(mask.type(), CV_8UC1);
    for (std::size_t i = 0; i < names.size(); ++i) {
        EXPECT_LE((three_numbers(directions[i]) - lights_[i].direction).norm(), 1e-5);
        const Eigen::Vector3d intensity = three_numbers(intensities[i]);
        const cv::Mat bgr = cv::imread((at("set") / names[i]).string(), cv::IMREAD_UNCHANGED);
        ASSERT_EQ(bgr.type(), CV_16UC3) << names[i];
        const cv::Mat3f truth = test::lambert_ball(lights_[i]);
        double worst = 0;
        for (int v = 0; v < bgr.rows; ++v)
            for (int u = 0; u < bgr.cols; ++u)
                for (int c = 0; c < 3; ++c)
                    worst = std::max(
                        worst, std::abs(bgr.at<cv::Vec3w>(v, u)[2 - c] / 65535.0 / intensity[c] - truth(v, u)[c]));
        EXPECT_LE(worst, 2.0 / 65535) << names[i];
    }
}

}  // namespace
}  // namespace darkbox
