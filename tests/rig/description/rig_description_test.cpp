#include "rig/description/rig_description.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <set>

#include "acquisition/frame/error.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

fs::path example(const std::string& name) { return fs::path(DARKBOX_RIG_EXAMPLES) / name; }

double length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

double angle_between_deg(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    const double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    return std::acos(std::min(1.0, dot / (length(a) * length(b)))) * 180.0 / std::numbers::pi;
}

TEST(RigDescription, ReadsEveryKey) {
    const std::string toml = R"([rig]
name = "all keys"
[camera]
driver = "sim"
device = "camera 7"
exposure_ms = 12.5
gain = 2
[camera.intrinsics]
mm_per_pixel = 0.25
[ball]
diameter_mm = 31.5
[capture]
frame_deadline_s = 3.5
tries = 7
min_signal = 0.01
max_dark = 0.03
[processing]
[api]
sessions = "/srv/sessions"
socket = "/run/darkbox.sock"
[sim]
scene = "teapot"
width = 64
height = 48
bit_depth = 10
full_well_e = 9000
read_noise_e = 3.5
latency_frames = 2
queue_depth = 4
seed = 99
real_time = true
quick_noise = true
colour = "rggb"
[lamps]
driver = "sim"
[[lamps.lamp]]
name = "north"
channel = 5
position_mm = [0, 500.5, 300]
max_on_s = 1.5
settle_ms = 8
)";
    const RigDescription rig = parse_rig(toml, "rig.toml");
    EXPECT_EQ(rig.name, "all keys");
    EXPECT_EQ(rig.camera.driver, "sim");
    EXPECT_EQ(rig.camera.device, "camera 7");
    EXPECT_DOUBLE_EQ(rig.camera.exposure.count(), 0.0125);
    EXPECT_EQ(rig.camera.gain, 2);
    EXPECT_EQ(rig.camera.mm_per_pixel, 0.25);
    EXPECT_EQ(rig.ball_diameter_mm, 31.5);
    EXPECT_EQ(rig.capture.frame_deadline.count(), 3.5);
    EXPECT_EQ(rig.capture.tries, 7);
    EXPECT_EQ(rig.capture.min_signal, 0.01);
    EXPECT_EQ(rig.capture.max_dark, 0.03);
    EXPECT_EQ(rig.sessions_folder, "/srv/sessions");
    EXPECT_EQ(rig.socket, "/run/darkbox.sock");
    EXPECT_EQ(rig.sim.scene, "teapot");
    EXPECT_EQ(rig.sim.width, 64);
    EXPECT_EQ(rig.sim.height, 48);
    EXPECT_EQ(rig.sim.bit_depth, 10);
    EXPECT_EQ(rig.sim.full_well_e, 9000);
    EXPECT_EQ(rig.sim.read_noise_e, 3.5);
    EXPECT_EQ(rig.sim.latency_frames, 2);
    EXPECT_EQ(rig.sim.queue_depth, 4);
    EXPECT_EQ(rig.sim.seed, 99);
    EXPECT_TRUE(rig.sim.real_time);
    EXPECT_TRUE(rig.sim.quick_noise);
    EXPECT_EQ(rig.sim.colour, "rggb");
    EXPECT_EQ(rig.lamps_driver, "sim");
    ASSERT_EQ(rig.lamps.size(), 1);
    EXPECT_EQ(rig.lamps[0].name, "north");
    EXPECT_EQ(rig.lamps[0].channel, 5);
    EXPECT_EQ(rig.lamps[0].position_mm, (std::array<double, 3>{0, 500.5, 300}));
    EXPECT_EQ(rig.lamps[0].max_on.count(), 1.5);
    EXPECT_DOUBLE_EQ(rig.lamps[0].settle.count(), 0.008);
    EXPECT_EQ(rig.toml, toml) << "the text is kept byte for byte";
}

TEST(RigDescription, LeavesOutWhatHasADefault) {
    const RigDescription rig = parse_rig(
        "[rig]\nname = \"small\"\n[lamps]\n[[lamps.lamp]]\nname = \"a\"\nchannel = 0\nposition_mm = [0, 0, 900]\n",
        "rig.toml");
    EXPECT_EQ(rig.camera.driver, "sim");
    EXPECT_EQ(rig.camera.exposure.count(), 0.02);
    EXPECT_FALSE(rig.camera.mm_per_pixel);
    EXPECT_FALSE(rig.ball_diameter_mm);
    EXPECT_EQ(rig.capture.tries, 3);
    EXPECT_EQ(rig.sim.width, 320);
    EXPECT_EQ(rig.lamps[0].max_on.count(), 2.0);
    EXPECT_TRUE(rig.sessions_folder.empty());
}

TEST(RigExamples, NineLampsOnGpio) {
    const RigDescription rig = load_rig(example("gpio-9-lamps.toml"));
    EXPECT_EQ(rig.lamps_driver, "gpio");
    EXPECT_EQ(rig.gpio.chip, "pinctrl-bcm2711");
    EXPECT_FALSE(rig.gpio.multiplexer);
    EXPECT_EQ(rig.camera.driver, "v4l2");
    ASSERT_EQ(rig.lamps.size(), 9);
    EXPECT_EQ(rig.lamps[0].line, "GPIO17");
    EXPECT_EQ(rig.lamps[0].channel, -1);
    for (const LampDescription& lamp : rig.lamps) EXPECT_NEAR(length(lamp.position_mm), 600, 0.2) << lamp.name;
}

TEST(RigExamples, SixtyFourLampsOnUsb) {
    const RigDescription rig = load_rig(example("usb-64-lamps.toml"));
    EXPECT_EQ(rig.lamps_driver, "usb");
    ASSERT_EQ(rig.lamps.size(), 64);
    EXPECT_EQ(rig.lamps[63].channel, 63);
    for (const LampDescription& lamp : rig.lamps) EXPECT_NEAR(length(lamp.position_mm), 1000, 0.2) << lamp.name;
}

TEST(RigExamples, TheSimulatedRigIsTheBuiltInOne) {
    const RigDescription rig = load_rig(example("simulated-12-lamps.toml"));
    EXPECT_EQ(rig.toml, simulated_rig_toml(12));
    EXPECT_EQ(rig.lamps.size(), 12);
}

class SimulatedRig : public testing::TestWithParam<int> {};

TEST_P(SimulatedRig, IsADomeOfLampsThatRoundTrips) {
    const int count = GetParam();
    const std::string toml = simulated_rig_toml(count);
    const RigDescription rig = parse_rig(toml, "built-in");
    EXPECT_EQ(rig.toml, toml);
    ASSERT_EQ(rig.lamps.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(rig.lamps.front().name, "lamp-01");
    for (int i = 0; i < count; ++i) {
        const LampDescription& lamp = rig.lamps[static_cast<std::size_t>(i)];
        const double elevation = std::asin(lamp.position_mm[2] / length(lamp.position_mm)) * 180 / std::numbers::pi;
        EXPECT_EQ(lamp.channel, i);
        EXPECT_NEAR(length(lamp.position_mm), 1000, 0.2);
        EXPECT_GT(elevation, 34.9);
        EXPECT_LT(elevation, 75.1);
    }
}

TEST_P(SimulatedRig, SpreadsItsLamps) {
    const RigDescription rig = parse_rig(simulated_rig_toml(GetParam()), "built-in");
    std::array<int, 4> in_quadrant{};
    for (std::size_t i = 0; i < rig.lamps.size(); ++i) {
        const auto& p = rig.lamps[i].position_mm;
        ++in_quadrant.at((p[0] > 0 ? 1 : 0) + (p[1] > 0 ? 2 : 0));
        for (std::size_t j = 0; j < i; ++j)
            EXPECT_GT(angle_between_deg(p, rig.lamps[j].position_mm), 60 / std::sqrt(rig.lamps.size()))
                << rig.lamps[i].name << " and " << rig.lamps[j].name;
    }
    const int most = *std::max_element(in_quadrant.begin(), in_quadrant.end());
    EXPECT_LE(most, GetParam() / 4 + 3) << "azimuths are spread";
}

INSTANTIATE_TEST_SUITE_P(AnyNumber, SimulatedRig, testing::Values(3, 4, 9, 12, 64));

TEST(SimulatedRigErrors, NeedsThreeToSixtyFourLamps) {
    for (const int count : {-1, 0, 2, 65}) EXPECT_THROW(simulated_rig_toml(count), InputError) << count;
}

TEST(LoadRig, NamesAFileThatIsNotThere) {
    const test::TemporaryFolder folder;
    try {
        load_rig(folder.path() / "none.toml");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("none.toml: there is no such file"));
    }
    EXPECT_THROW(load_rig(folder.path()), InputError) << "a folder is no file";
}

TEST(LoadRig, RefusesAHugeFileBeforeReadingIt) {
    const test::TemporaryFolder folder;
    const fs::path file = folder.path() / "huge.toml";
    std::ofstream(file).put('\n');
    fs::resize_file(file, std::uintmax_t{1} << 40);
    EXPECT_THROW(load_rig(file), InputError);
}

}  // namespace
}  // namespace darkbox
