#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "acquisition/frame/error.h"
#include "processing/formats/ptm_file.h"
#include "tests/processing/formats/ptm_scene.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

/// A viewer after Relight's description of its web format: value = (sample - bias) scale, terms 1, u, v, u^2, uv, v^2.
class WebViewer {
public:
    explicit WebViewer(const std::filesystem::path& folder) {
        info = nlohmann::json::parse(std::ifstream(folder / "info.json"));
        for (int i = 0; 3 * i < info["nplanes"].get<int>(); ++i)
            pictures.push_back(
                cv::imread((folder / ("plane_" + std::to_string(i) + ".jpg")).string(), cv::IMREAD_COLOR));
    }

    std::array<double, 3> shown(int x, int y, double u, double v) const {
        const std::array<double, 6> terms = {1, u, v, u * u, u * v, v * v};
        std::array<double, 3> sample{};
        if (info["colorspace"] == "rgb") {
            for (std::size_t p = 0; p < 6; ++p)
                for (std::size_t c = 0; c < 3; ++c) sample[c] += terms[p] * value(p, c, x, y);
            return sample;
        }
        double luminance = 0;
        for (std::size_t t = 0; t < 6; ++t) luminance += terms[t] * value(1 + t / 3, t % 3, x, y);
        for (std::size_t c = 0; c < 3; ++c) sample[c] = luminance * value(0, c, x, y);
        return sample;
    }

    nlohmann::json info;
    std::vector<cv::Mat3b> pictures;  ///< B, G, R, as OpenCV reads them

private:
    double value(std::size_t picture, std::size_t channel, int x, int y) const {
        const auto& material = info["materials"][0];
        const std::size_t plane = 3 * picture + channel;
        const double sample = pictures.at(picture)(y, x)[static_cast<int>(2 - channel)] / 255.0;
        return (sample - material["bias"][plane].get<double>()) * material["scale"][plane].get<double>();
    }
};

class RelightWeb : public testing::TestWithParam<PtmModel> {
protected:
    test::TemporaryFolder folder_;
};

TEST_P(RelightWeb, AViewerShowsWhatWasFitted) {
    const Ptm ptm = test::some_ptm(GetParam());
    Lights lights(2);
    lights[1].used = false;
    write_relight_web(folder_.path() / "web", ptm, lights, 100);
    const WebViewer viewer(folder_.path() / "web");
    EXPECT_EQ(viewer.info["width"], 24);
    EXPECT_EQ(viewer.info["height"], 16);
    EXPECT_EQ(viewer.info["format"], "jpg");
    EXPECT_EQ(viewer.info["type"], "ptm");
    EXPECT_EQ(viewer.info["quality"], 100);
    EXPECT_EQ(viewer.info["lights"], nlohmann::json({0.0, 0.0, 1.0})) << "lights that were not used are not listed";
    const std::size_t planes = GetParam() == PtmModel::rgb ? 18 : 9;
    EXPECT_EQ(viewer.info["nplanes"], planes);
    EXPECT_EQ(viewer.info["materials"][0]["scale"].size(), planes);
    EXPECT_EQ(viewer.info["materials"][0]["bias"].size(), planes);
    for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(0.5, -0.3)}) {
        const cv::Mat3f expected = evaluate(ptm, {u, v, std::sqrt(1 - u * u - v * v)});
        double squares = 0;
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 24; ++x)
                for (std::size_t c = 0; c < 3; ++c)
                    squares += std::pow(viewer.shown(x, y, u, v)[c] - expected(y, x)[static_cast<int>(c)], 2);
        EXPECT_LT(std::sqrt(squares / (16 * 24 * 3)), 0.005) << "a JPEG of the best quality is off by about a byte";
    }
}

TEST_P(RelightWeb, WhatCannotBeWrittenIsSaid) {
    EXPECT_THAT(test::input_error_of([] { write_relight_web("/proc/none", test::some_ptm(GetParam()), {}, 90); }),
                testing::HasSubstr("/proc/none"));
}

INSTANTIATE_TEST_SUITE_P(BothModels, RelightWeb, testing::Values(PtmModel::rgb, PtmModel::lrgb));

}  // namespace
}  // namespace darkbox
