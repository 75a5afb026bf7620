#include "sim/truth.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "acquisition/device/device_error.h"
#include "sim/renderer.h"
#include "sim/scenes.h"
#include "sim/sim_rig.h"
#include "tests/sim/sim_test_support.h"
#include "tests/support/test_data.h"

namespace darkbox::sim {
namespace {

std::string text_of(const std::filesystem::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

RgbImage read_exr(const std::filesystem::path& file) {
    Imf::InputFile input(file.c_str());
    const auto window = input.header().dataWindow();
    RgbImage image(window.max.x + 1, window.max.y + 1);
    Imf::FrameBuffer buffer;
    const std::size_t pixel = 3 * sizeof(float);
    auto* base = reinterpret_cast<char*>(image.samples.data());
    buffer.insert("R", Imf::Slice(Imf::FLOAT, base, pixel, pixel * image.width));
    buffer.insert("G", Imf::Slice(Imf::FLOAT, base + sizeof(float), pixel, pixel * image.width));
    buffer.insert("B", Imf::Slice(Imf::FLOAT, base + 2 * sizeof(float), pixel, pixel * image.width));
    input.setFrameBuffer(buffer);
    input.readPixels(0, window.max.y);
    return image;
}

std::vector<float> read_heights(const std::filesystem::path& file) {
    Imf::InputFile input(file.c_str());
    const auto window = input.header().dataWindow();
    std::vector<float> values(static_cast<std::size_t>(window.max.x + 1) * (window.max.y + 1));
    Imf::FrameBuffer buffer;
    buffer.insert("Y", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), sizeof(float),
                                  sizeof(float) * static_cast<std::size_t>(window.max.x + 1)));
    input.setFrameBuffer(buffer);
    input.readPixels(0, window.max.y);
    return values;
}

TEST(Truth, HeightIsThatOfASphere) {
    Scene scene;
    scene.object.push_back({Sphere{{0, 0, 10}, 40}, {}});
    scene.object.back().material.texture = scene_by_name({.scene = "sphere"}, {}).object.front().material.texture;
    scene.view = {Projection::orthographic, 41, 41, 2.0, 800};
    const SceneTruth truth = render_truth(scene);
    EXPECT_NEAR(truth.heights[20 * 41 + 20], 50, 1e-4);
    EXPECT_NEAR(truth.heights[20 * 41 + 32], 10 + std::sqrt(40.0 * 40 - 24 * 24), 1e-4);
    EXPECT_EQ(truth.heights[0], 0) << "the backdrop is not the object";
}

TEST(Truth, FilesHoldWhatWasTrue) {
    const test::TemporaryFolder folder;
    SimRig rig = SimRig::make(small_rig("torus-moss"));
    rig.camera().configure({});
    rig.camera().start();
    const Nanoseconds second{1'000'000'000};
    rig.camera().next_frame(rig.clock().now() + second);
    rig.lamps().light(LampId{1}, 1.0);
    rig.camera().next_frame(rig.clock().now() + second);
    rig.write_truth(folder.path() / "truth");

    const auto path = folder.path() / "truth";
    const SceneTruth truth = render_truth(rig.scene());
    EXPECT_EQ(read_exr(path / "normals.exr").samples, truth.normals.samples);
    EXPECT_EQ(read_exr(path / "albedo.exr").samples, truth.albedo.samples);
    EXPECT_EQ(read_heights(path / "height.exr"), truth.heights);
    const cv::Mat1b mask = cv::imread((path / "mask.png").string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(mask.cols, 64);
    for (int v = 0; v < 48; ++v)
        for (int u = 0; u < 64; ++u)
            ASSERT_EQ(mask(v, u), truth.mask[static_cast<std::size_t>(v * 64 + u)] != 0 ? 255 : 0);

    const cv::Mat1w texels = cv::imread((path / "texels.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_TRUE(std::equal(texels.begin(), texels.end(), truth.materials.begin(), truth.materials.end()));

    EXPECT_EQ(text_of(path / "lights.lp"),
              "3\nlamp-1 0.000000000 0.573462344 0.819231921\nlamp-2 0.573462344 0.000000000 0.819231921\n"
              "lamp-3 0.000000000 0.000000000 1.000000000\n");
    const auto lamps = nlohmann::json::parse(text_of(path / "lamps.json"));
    ASSERT_EQ(lamps["frames"].size(), 2U);
    EXPECT_TRUE(lamps["frames"][0]["lamps"].empty());
    EXPECT_EQ(lamps["frames"][1]["sequence"], 1);
    EXPECT_EQ(lamps["frames"][1]["lamps"][0]["name"], "lamp-2");
    EXPECT_EQ(lamps["frames"][1]["lamps"][0]["share"], 1.0);
    const auto ball = nlohmann::json::parse(text_of(path / "ball.json"))["balls"][0];
    EXPECT_NEAR(ball["radius"].get<double>(), 18.0 / 3.125, 1e-9);
    EXPECT_NEAR(ball["x"].get<double>(), 22.0 / 3.125 - 0.5, 1e-9);
    EXPECT_NEAR(ball["y"].get<double>(), 47.5 - 22.0 / 3.125, 1e-9);
}

TEST(Truth, MaterialsArePartedWhereTheColourIs) {
    const Scene scene = SimRig::make(small_rig("torus-brick")).scene();
    const SceneTruth truth = render_truth(scene);
    double mortar = 0, brick = 0;  // redness
    int mortar_pixels = 0, brick_pixels = 0;
    for (std::size_t i = 0; i < truth.materials.size(); ++i) {
        ASSERT_EQ(truth.materials[i] != 0, truth.mask[i] != 0);
        if (truth.materials[i] == 0) continue;
        const float* rgb = &truth.albedo.samples[3 * i];
        (truth.materials[i] == 1 ? mortar : brick) += rgb[0] / rgb[2];
        ++(truth.materials[i] == 1 ? mortar_pixels : brick_pixels);
    }
    ASSERT_GT(mortar_pixels, 50);
    ASSERT_GT(brick_pixels, 500);
    EXPECT_GT(brick / brick_pixels, 1.5 * mortar / mortar_pixels);
}

TEST(Truth, AFolderThatCannotBeMadeIsNamed) {
    const test::TemporaryFolder folder;
    std::ofstream(folder.path() / "file") << "in the way";
    const SimRig rig = SimRig::make(small_rig());
    EXPECT_THROW(rig.write_truth(folder.path() / "file" / "truth"), DeviceError);
}

}  // namespace
}  // namespace darkbox::sim
