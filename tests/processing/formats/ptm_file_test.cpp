#include "processing/formats/ptm_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "acquisition/frame/error.h"
#include "tests/processing/formats/ptm_scene.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

/// A viewer after the format's description (Malzbender, Gelb 2001, sections 2 and 3).
class PtmViewer {
public:
    explicit PtmViewer(const std::filesystem::path& path) {
        std::ifstream in(path, std::ios::binary);
        std::string version;
        in >> version >> format >> width >> height;
        EXPECT_EQ(version, "PTM_1.2");
        for (double& s : scale) in >> s;
        for (int& b : bias) in >> b;
        while (in.get() != '\n') continue;
        data.assign(std::istreambuf_iterator<char>(in), {});
    }

    /// Samples on 0...255 at column x and row y from the top.
    std::array<double, 3> shown(int x, int y, double u, double v) const {
        const std::size_t pixel =
            static_cast<std::size_t>(height - 1 - y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
        const std::size_t block = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 6;
        if (format == "PTM_FORMAT_RGB")
            return {polynomial(pixel * 6, u, v), polynomial(block + pixel * 6, u, v),
                    polynomial(2 * block + pixel * 6, u, v)};
        const double luminance = polynomial(pixel * 6, u, v) / 255;
        return {luminance * byte(block + pixel * 3), luminance * byte(block + pixel * 3 + 1),
                luminance * byte(block + pixel * 3 + 2)};
    }

    std::string format;
    int width = 0, height = 0;
    std::array<double, 6> scale{};
    std::array<int, 6> bias{};
    std::string data;

private:
    double byte(std::size_t at) const { return static_cast<unsigned char>(data.at(at)); }
    double polynomial(std::size_t at, double u, double v) const {
        const std::array<double, 6> terms = {u * u, v * v, u * v, u, v, 1};
        double sum = 0;
        for (std::size_t i = 0; i < 6; ++i) sum += (byte(at + i) - bias[i]) * scale[i] * terms[i];
        return sum;
    }
};

class PtmFile : public testing::TestWithParam<PtmModel> {
protected:
    std::filesystem::path path() const { return folder_.path() / "s.ptm"; }
    test::TemporaryFolder folder_;
};

TEST_P(PtmFile, AViewerShowsWhatWasFittedToWithinTheBytes) {
    const Ptm ptm = test::some_ptm(GetParam());
    write_ptm(path(), ptm);
    const PtmViewer viewer(path());
    EXPECT_EQ(viewer.format, GetParam() == PtmModel::rgb ? "PTM_FORMAT_RGB" : "PTM_FORMAT_LRGB");
    ASSERT_EQ(viewer.width, 24);
    ASSERT_EQ(viewer.height, 16);
    ASSERT_EQ(viewer.data.size(), 24u * 16u * (GetParam() == PtmModel::rgb ? 18u : 9u));
    for (const auto& [u, v] : {std::pair(0.0, 0.0), std::pair(0.5, -0.3), std::pair(-0.2, 0.8)}) {
        const Eigen::Vector3d light(u, v, std::sqrt(1 - u * u - v * v));
        const std::array<double, 6> terms = ptm_basis(light);
        double bound = 1e-3;  // half a step of every coefficient; lrgb adds half a byte of colour
        for (std::size_t i = 0; i < 6; ++i) bound += viewer.scale[i] / 2 * std::abs(terms[i]);
        if (GetParam() == PtmModel::lrgb) bound += 0.75;
        const cv::Mat3f expected = evaluate(ptm, light);
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 24; ++x) {
                const auto shown = viewer.shown(x, y, u, v);
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(shown[static_cast<std::size_t>(c)], 255 * expected(y, x)[c], bound)
                        << x << ", " << y << ", channel " << c;
            }
    }
    for (const double scale : viewer.scale) EXPECT_LT(scale, 1.0) << "a byte is a fine enough step here";
}

TEST_P(PtmFile, WhatCannotBeWrittenIsSaid) {
    EXPECT_THAT(test::input_error_of([] { write_ptm("/proc/none/s.ptm", test::some_ptm(GetParam())); }),
                testing::HasSubstr("/proc/none"));
}

INSTANTIATE_TEST_SUITE_P(BothModels, PtmFile, testing::Values(PtmModel::rgb, PtmModel::lrgb));

}  // namespace
}  // namespace darkbox
