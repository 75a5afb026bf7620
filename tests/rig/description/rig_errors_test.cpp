#include <gmock/gmock.h>

#include <ostream>
#include <string>

#include "acquisition/frame/error.h"
#include "rig/description/rig_description.h"

namespace darkbox {
namespace {

constexpr const char* good = R"([rig]
name = "bench"
[camera]
driver = "sim"
exposure_ms = 20
[camera.intrinsics]
mm_per_pixel = 0.5
[capture]
tries = 3
[processing]
[api]
socket = "s"
[sim]
width = 320
[lamps]
driver = "sim"
[[lamps.lamp]]
name = "a"
channel = 0
position_mm = [0, 0, 900]
[[lamps.lamp]]
name = "b"
channel = 1
position_mm = [0, 500, 700]
)";

/// A real camera's rig with `lines` in its [camera].
std::string real(const std::string& lines) {
    return "[rig]\nname = \"r\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"cam\"\n" + lines +
           "\n[lamps]\ndriver = \"gpio\"\n[lamps.gpio]\nchip = \"c\"\n[[lamps.lamp]]\nname = \"a\"\nline = "
           "\"L1\"\nposition_mm = [0, 0, 900]\n";
}

/// The good rig with one piece of its text replaced.
std::string with(const std::string& piece, const std::string& other) {
    std::string toml = good;
    const std::size_t at = toml.find(piece);
    EXPECT_NE(at, std::string::npos) << piece;
    return toml.replace(at, piece.size(), other);
}

std::string error_of(const std::string& toml) {
    try {
        parse_rig(toml, "rig.toml");
    } catch (const InputError& error) {
        EXPECT_FALSE(error.hint().empty()) << error.what();
        return error.what();
    }
    return "no error";
}

struct BadRig {
    std::string label;
    std::string toml;
    std::string message;  ///< a part of what is said
};

void PrintTo(const BadRig& rig, std::ostream* out) { *out << rig.label; }

class RigErrors : public testing::TestWithParam<BadRig> {};

TEST_P(RigErrors, NamesLineFieldAndRemedy) {
    EXPECT_THAT(error_of(GetParam().toml), testing::HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Unknown, RigErrors,
    testing::Values(BadRig{"key", with("exposure_ms = 20", "exposure_mss = 20"),
                           "rig.toml:5: unknown key 'exposure_mss' in [camera]; did you mean 'exposure_ms'?"},
                    BadRig{"lamp", with("channel = 1", "chanel = 1"),
                           "rig.toml:23: unknown key 'chanel' in [[lamps.lamp]]; did you mean 'channel'?"},
                    BadRig{"lamp2", with("channel = 1", "channel = 1\nsetle_ms = 1"),
                           "rig.toml:24: unknown key 'setle_ms' in [[lamps.lamp]]; did you mean 'settle_ms'?"},
                    BadRig{"section", with("[capture]", "[captrue]"), "rig.toml:8: unknown section 'captrue'"},
                    BadRig{"suggestion", with("[capture]", "[captrue]"), "did you mean 'capture'?"},
                    BadRig{"processing", with("[processing]", "[processing]\nsolver = \"lsq\""),
                           "rig.toml:11: unknown key 'solver' in [processing]"},
                    BadRig{"first", with("width = 320", "zidth = 1\nabc = 2"),
                           "rig.toml:14: unknown key 'zidth' in [sim]"},
                    BadRig{"intrinsics", with("mm_per_pixel = 0.5", "mm_per_px = 0.5"), "in [camera.intrinsics]"}));

INSTANTIATE_TEST_SUITE_P(
    WrongType, RigErrors,
    testing::Values(
        BadRig{"number", with("exposure_ms = 20", "exposure_ms = \"20\""),
               "rig.toml:5: [camera] exposure_ms must be a number, but is text"},
        BadRig{"whole", with("tries = 3", "tries = 3.5"), "rig.toml:9: [capture] tries must be a whole number"},
        BadRig{"text", with("name = \"bench\"", "name = 7"), "rig.toml:2: [rig] name must be text"},
        BadRig{"flag", with("width = 320", "real_time = 1"), "real_time must be true or false, but is a whole number"},
        BadRig{"table", with("[capture]\ntries = 3", "[[capture]]\ntries = 3"), "capture must be a table"},
        BadRig{"lamps",
               with("[[lamps.lamp]]\nname = \"a\"\nchannel = 0\nposition_mm = [0, 0, 900]\n"
                    "[[lamps.lamp]]\nname = \"b\"\nchannel = 1\nposition_mm = [0, 500, 700]\n",
                    "lamp = [1, 2]\n"),
               "lamp must be a list of tables"},
        BadRig{"position", with("[0, 0, 900]", "[0, 900]"), "position_mm must be 3 numbers in brackets"},
        BadRig{"element", with("[0, 0, 900]", "[0, \"0\", 900]"), "position_mm must be 3 numbers in brackets"},
        BadRig{"date", with("exposure_ms = 20", "exposure_ms = 2020-01-01"), "but is a date or time"}));

INSTANTIATE_TEST_SUITE_P(
    OutOfRange, RigErrors,
    testing::Values(BadRig{"exposure", with("exposure_ms = 20", "exposure_ms = 0"),
                           "rig.toml:5: [camera] exposure_ms is 0; allowed: 0.001 to 60000"},
                    BadRig{"nan", with("exposure_ms = 20", "exposure_ms = nan"), "exposure_ms is nan; allowed"},
                    BadRig{"inf", with("mm_per_pixel = 0.5", "mm_per_pixel = inf"), "mm_per_pixel is inf; allowed"},
                    BadRig{"tries", with("tries = 3", "tries = 0"), "[capture] tries is 0; allowed: 1 to 100"},
                    BadRig{"huge", with("width = 320", "width = 9223372036854775807"), "allowed: 16 to 8192"},
                    BadRig{"too_huge", with("width = 320", "width = 9223372036854775808"), "rig.toml:14:"},
                    BadRig{"driver", with("driver = \"sim\"", "driver = \"usb\""), "allowed: \"v4l2\", \"sim\""},
                    BadRig{"infinite", with("[0, 0, 900]", "[0, -inf, 900]"), "position_mm has the element -inf"},
                    BadRig{"nan_position", with("[0, 0, 900]", "[nan, 0, 900]"), "position_mm has the element nan"},
                    BadRig{"at_object", with("[0, 0, 900]", "[0, 0, 0]"),
                           "rig.toml:20: [[lamps.lamp]] position_mm is 0 mm"},
                    BadRig{"far", with("[0, 0, 900]", "[0, 0, 9e9]"), "allowed: 10 to 100000"},
                    BadRig{"channel", with("channel = 1", "channel = 64"),
                           "rig.toml:23: [[lamps.lamp]] channel is 64; allowed: 0 to 63"},
                    BadRig{"seed", with("width = 320", "seed = -1"), "seed is -1; allowed: at least 0"},
                    BadRig{"max_on", with("channel = 1", "channel = 1\nmax_on_s = 0.02"),
                           "rig.toml:24: [[lamps.lamp]] max_on_s is 0.02; allowed: more than"},
                    BadRig{"name", with("name = \"b\"", "name = \"../b\""), "cannot be part of a file name"}));

/// The good rig with one more section.
std::string and_section(const std::string& text) { return with("[processing]", text + "\n[processing]"); }

INSTANTIATE_TEST_SUITE_P(
    Health, RigErrors,
    testing::Values(
        BadRig{"good", and_section("[health]\nwarm_up = \"wait\"\nwarm_up_s = 300\nhottest_c = 60"), "no error"},
        BadRig{"rule", and_section("[health]\nwarm_up = \"maybe\""), "rig.toml:11: [health] has warm_up = \"maybe\""},
        BadRig{"none", and_section("[health]\nwarm_up = \"none\""), "has warm_up = \"none\""},
        BadRig{"nobody_waits", and_section("[health]\nwarm_up = \"warn\"\nwarm_up_s = 300"),
               "has warm_up_s, but nothing that waits"},
        BadRig{"nobody_looks", and_section("[health]\nsteady_level = 0.001"), "has steady_level without warm_up"},
        BadRig{"level", and_section("[health]\nwarm_up = \"wait\"\nsteady_level = 0"), "steady_level is 0; allowed"},
        BadRig{"cold", and_section("[health]\nhottest_c = -3"), "hottest_c is -3; allowed: 20 to 120"},
        BadRig{"no_thermometer", real("") + "[health]\nhottest_c = 60\n", "lamps have no thermometer"}));

TEST(RigHealth, IsReadAndLooksAtNothingUnlessAsked) {
    EXPECT_EQ(parse_rig(good, "").health.warm_up, WarmUpRule::none);
    EXPECT_FALSE(parse_rig(good, "").health.hottest_c);
    const RigDescription rig = parse_rig(
        and_section("[health]\nwarm_up = \"wait\"\nwarm_up_s = 300\nsteady_level = 0.001\nhottest_c = 60"), "");
    EXPECT_EQ(rig.health.warm_up, WarmUpRule::wait);
    EXPECT_EQ(rig.health.warm_up_longest, Seconds(300));
    EXPECT_EQ(rig.health.steady_level, 0.001);
    EXPECT_EQ(rig.health.hottest_c, 60);
}

INSTANTIATE_TEST_SUITE_P(Tls, RigErrors,
                         testing::Values(BadRig{"good", with("socket = \"s\"", "certificate = \"c\"\nkey = \"k\""),
                                                "no error"},
                                         BadRig{"no_key", with("socket = \"s\"", "certificate = \"c\""),
                                                "rig.toml:12: [api] has certificate without key"},
                                         BadRig{"no_certificate", with("socket = \"s\"", "key = \"k\""),
                                                "[api] has key without certificate"}));

INSTANTIATE_TEST_SUITE_P(RealCamera, RigErrors,
                         testing::Values(BadRig{"good", real("format = \"Y16\""), "no error"},
                                         BadRig{"simulated", with("exposure_ms = 20", "frame_rate = 20"),
                                                "rig.toml:5: [camera] frame_rate does not belong to driver \"sim\""},
                                         BadRig{"no_height", real("width = 640"), "has one of width and height"},
                                         BadRig{"no_width", real("height = 640"), "has one of width and height"},
                                         BadRig{"width", real("width = 0\nheight = 2"),
                                                "rig.toml:6: [camera] width is 0; allowed: 1 to 65535"},
                                         BadRig{"rate", real("frame_rate = 0"), "frame_rate is 0; allowed"},
                                         BadRig{"crop", real("crop = [0, 0, 10]"), "crop must be 4 numbers"},
                                         BadRig{"crop_part", real("crop = [0, 0.5, 10, 10]"), "crop holds 0.5"},
                                         BadRig{"crop_size", real("crop = [0, 0, 0, 10]"), "crop holds 0;"},
                                         BadRig{"crop_nan", real("crop = [0, 0, 10, nan]"),
                                                "crop has the element nan"}));

TEST(RigCamera, KeysOfARealOne) {
    const CameraDescription camera =
        parse_rig(real("format = \"pRAA\"\nwidth = 640\nheight = 480\nframe_rate = 7.5\ncrop = [8, 16, 640, 480]"),
                  "rig.toml")
            .camera;
    EXPECT_EQ(camera.format, "pRAA");
    EXPECT_EQ(camera.width, 640);
    EXPECT_EQ(camera.height, 480);
    EXPECT_EQ(camera.frame_rate, 7.5);
    EXPECT_EQ(camera.crop, (std::array{8, 16, 640, 480}));
}

/// Four lamps on GPIO lines; `gpio` is what follows [lamps.gpio], `lamp` what follows the first lamp's name.
std::string gpio_rig(const std::string& gpio, const std::string& lamp) {
    return "[rig]\nname = \"bench\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"/dev/video0\"\n[lamps]\n"
           "driver = \"gpio\"\n[lamps.gpio]\n" +
           gpio + "\n[[lamps.lamp]]\nname = \"a\"\nposition_mm = [0, 0, 900]\n" + lamp + "\n";
}

const char* const decoder =
    "chip = \"c\"\n[lamps.gpio.multiplexer]\naddress_lines = [\"A0\", 7]\nenable_line = \"EN\"\n";

TEST(GpioRig, ReadsPolarityFromTheChipOrTheLamp) {
    EXPECT_FALSE(parse_rig(gpio_rig("chip = \"c\"", "line = 4"), "rig.toml").lamps[0].active_low);
    EXPECT_TRUE(parse_rig(gpio_rig("chip = \"c\"\nactive_low = true", "line = 4"), "rig.toml").lamps[0].active_low);
    const RigDescription rig =
        parse_rig(gpio_rig("chip = \"c\"\nactive_low = true", "line = \"GPIO4\"\nactive_low = false"), "rig.toml");
    EXPECT_FALSE(rig.lamps[0].active_low);
    EXPECT_EQ(rig.lamps[0].line, "GPIO4");
}

TEST(GpioRig, ReadsAMultiplexer) {
    const RigDescription rig = parse_rig(gpio_rig(decoder, "address = 3"), "rig.toml");
    ASSERT_TRUE(rig.gpio.multiplexer);
    EXPECT_THAT(rig.gpio.multiplexer->address_lines, testing::ElementsAre("A0", "7"));
    EXPECT_EQ(rig.gpio.multiplexer->enable_line, "EN");
    EXPECT_FALSE(rig.gpio.multiplexer->enable_active_low);
    EXPECT_EQ(rig.lamps[0].address, 3);
}

INSTANTIATE_TEST_SUITE_P(
    Gpio, RigErrors,
    testing::Values(
        BadRig{"chip", gpio_rig("chp = \"c\"", "line = 4"),
               "rig.toml:9: unknown key 'chp' in [lamps.gpio]; did you mean 'chip'?"},
        BadRig{"no_chip", gpio_rig("", "line = 4"), "[lamps.gpio] chip is missing"},
        BadRig{"active_low", gpio_rig("chip = \"c\"", "line = 4\nactive_lo = true"), "did you mean 'active_low'?"},
        BadRig{"polarity", gpio_rig("chip = \"c\"", "line = 4\nactive_low = 1"), "active_low must be true or false"},
        BadRig{"address_alone", gpio_rig("chip = \"c\"", "address = 1"),
               "rig.toml:13: [[lamps.lamp]] address does not belong to driver \"gpio\""},
        BadRig{"line_too", gpio_rig(decoder, "line = 1"), "line does not belong to driver \"gpio\" with a multiplexer"},
        BadRig{"address_range", gpio_rig(decoder, "address = 4"), "address is 4; allowed: 0 to 3"},
        BadRig{"no_enable", gpio_rig("chip = \"c\"\n[lamps.gpio.multiplexer]\naddress_lines = [1]", "address = 1"),
               "enable_line is missing"},
        BadRig{"no_address_lines", gpio_rig("chip = \"c\"\n[lamps.gpio.multiplexer]\nenable_line = 1", "address = 1"),
               "address_lines names 0 lines; allowed: 1 to 6"},
        BadRig{"line_twice",
               gpio_rig("chip = \"c\"\n[lamps.gpio.multiplexer]\naddress_lines = [1]\nenable_line = 1", "address = 1"),
               "line '1' is named twice"},
        BadRig{"decoder_polarity", gpio_rig(decoder, "address = 1\nactive_low = true"),
               "active_low belongs to a lamp with a line of its own"},
        BadRig{"driver", with("[lamps]\ndriver = \"sim\"", "[lamps.gpio]\nchip = \"c\"\n[lamps]\ndriver = \"sim\""),
               "has [lamps.gpio], but driver \"sim\""}));

/// One lamp on the USB lamp controller.
std::string usb_rig(const std::string& usb, const std::string& lamp = "") {
    return "[rig]\nname = \"bench\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"/dev/video0\"\n[lamps]\n"
           "driver = \"usb\"\n[lamps.usb]\n" +
           usb + "\n[[lamps.lamp]]\nname = \"a\"\nchannel = 7\nposition_mm = [0, 0, 900]\n" + lamp + "\n";
}

TEST(UsbRig, ReadsSerialHeartbeatAndDuty) {
    const RigDescription rig =
        parse_rig(usb_rig("serial = \"LC-1\"\nheartbeat_ms = 100", "max_duty = 0.2"), "rig.toml");
    EXPECT_EQ(rig.usb.serial, "LC-1");
    EXPECT_DOUBLE_EQ(rig.usb.heartbeat.count(), 0.1);
    EXPECT_DOUBLE_EQ(rig.lamps[0].max_duty, 0.2);
    const RigDescription plain = parse_rig(usb_rig(""), "rig.toml");
    EXPECT_EQ(plain.usb.serial, "");
    EXPECT_DOUBLE_EQ(plain.usb.heartbeat.count(), 1.0);
}

INSTANTIATE_TEST_SUITE_P(
    Usb, RigErrors,
    testing::Values(
        BadRig{"heartbeat", usb_rig("heartbeat_ms = 40"), "heartbeat_ms is 40; allowed: 50 to 1000"},
        BadRig{"serial", usb_rig("serial = \"LC-0123456789\""), "serial has 13 characters; allowed: up to 12"},
        BadRig{"unknown", usb_rig("seriel = \"LC-1\""), "did you mean 'serial'?"},
        BadRig{"too_long", usb_rig("", "max_on_s = 61"), "max_on_s is 61; allowed with driver \"usb\": up to 60"},
        BadRig{"duty", usb_rig("", "max_duty = 0.9"), "max_duty is 0.9; allowed: 0.02 to 0.79"},
        BadRig{"duty_of_gpio", gpio_rig("chip = \"c\"", "line = 4\nmax_duty = 0.5"),
               "max_duty does not belong to driver \"gpio\""},
        BadRig{"usb_of_sim", with("[lamps]\ndriver = \"sim\"", "[lamps.usb]\n[lamps]\ndriver = \"sim\""),
               "has [lamps.usb], but driver \"sim\""},
        BadRig{"seen_without_time", with("width = 320", "width = 320\nlamps_seen = \"f\""),
               "has lamps_seen without real_time"},
        BadRig{"strobe_of_sim", with("width = 320", "width = 320\nstrobe_line = \"f\""),
               "has strobe_line without lamps_seen"},
        BadRig{"seen_of_sim", with("width = 320", "width = 320\nlamps_seen = \"f\"\nreal_time = true"),
               "has lamps_seen, but \"sim\" lamps"}));

INSTANTIATE_TEST_SUITE_P(
    DoNotFit, RigErrors,
    testing::Values(BadRig{"same_name", with("name = \"b\"", "name = \"a\""),
                           "rig.toml:22: [[lamps.lamp]] name 'a' of lamp 'a' is taken by lamp 1 ('a')"},
                    BadRig{"same_channel", with("channel = 1", "channel = 0"),
                           "rig.toml:23: [[lamps.lamp]] channel '0' of lamp 'b' is taken by lamp 1 ('a')"},
                    BadRig{"line", with("channel = 1", "channel = 1\nline = 4"),
                           "line does not belong to driver \"sim\""},
                    BadRig{"gpio", with("[lamps]\ndriver = \"sim\"", "[lamps]\ndriver = \"gpio\""),
                           "channel does not belong to driver \"gpio\""},
                    BadRig{"v4l2", with("driver = \"sim\"", "driver = \"v4l2\""), "device is missing"},
                    BadRig{"mixed", with("driver = \"sim\"", "driver = \"v4l2\"\ndevice = \"/dev/video0\""),
                           "has a \"v4l2\" camera and \"sim\" lamps"},
                    BadRig{"duplicate_key", with("tries = 3", "tries = 3\ntries = 4"), "rig.toml:10:"},
                    BadRig{"syntax", with("tries = 3", "tries ="), "rig.toml:9:"},
                    BadRig{"no_channel", with("channel = 1\n", ""), "rig.toml:21: [[lamps.lamp]] channel is missing"},
                    BadRig{"no_position", with("position_mm = [0, 0, 900]\n", ""),
                           "rig.toml:17: [[lamps.lamp]] position_mm is missing"},
                    BadRig{"no_rig", with("[rig]\nname = \"bench\"\n", ""), "has no [rig]"},
                    BadRig{"no_name", with("name = \"bench\"\n", ""), "rig.toml:1: [rig] name is missing"},
                    BadRig{"empty_name", with("name = \"bench\"", "name = \"\""), "name is empty"}));

INSTANTIATE_TEST_SUITE_P(
    Intrinsics, RigErrors,
    testing::Values(
        BadRig{"distance", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\ndistance_mm = 0"),
               "rig.toml:8: [camera.intrinsics] distance_mm is 0; allowed: 1 to 1000000"},
        BadRig{"distance_nan", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\ndistance_mm = nan"),
               "distance_mm is nan; allowed"},
        BadRig{"distance_alone", with("mm_per_pixel = 0.5", "distance_mm = 800"), "distance_mm needs mm_per_pixel"},
        BadRig{"focal_alone", with("mm_per_pixel = 0.5", "focal_length_px = 800"),
               "focal_length_px needs mm_per_pixel"},
        BadRig{"focal_negative", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\nfocal_length_px = -1"),
               "focal_length_px is -1; allowed"},
        BadRig{"disagree", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\ndistance_mm = 800\nfocal_length_px = 2000"),
               "rig.toml:9: [camera.intrinsics] focal_length_px times mm_per_pixel is 1000.0 mm, but distance_mm is "
               "800.0"},
        BadRig{"principal", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\nprincipal_px = [1]"),
               "principal_px must be 2 numbers in brackets"},
        BadRig{"principal_far", with("mm_per_pixel = 0.5", "mm_per_pixel = 0.5\nprincipal_px = [1, 1e9]"),
               "principal_px has 1000000000; allowed"},
        BadRig{"distant", with("[lamps]\ndriver = \"sim\"", "[lamps]\ndriver = \"sim\"\ndistant = 1"),
               "distant must be true or false"}));

TEST(RigIntrinsics, TwoTellTheThird) {
    const auto camera = [](const std::string& keys) {
        return parse_rig(with("mm_per_pixel = 0.5", keys), "rig.toml").camera;
    };
    EXPECT_FALSE(camera("mm_per_pixel = 0.5").distance_mm);
    EXPECT_DOUBLE_EQ(camera("mm_per_pixel = 0.5\nfocal_length_px = 1600").distance_mm.value(), 800);
    EXPECT_DOUBLE_EQ(camera("distance_mm = 800\nfocal_length_px = 1600").mm_per_pixel.value(), 0.5);
    EXPECT_EQ(camera("mm_per_pixel = 0.5\nprincipal_px = [150.5, 90]").principal_px->at(1), 90);
}

TEST(RigIntrinsics, SimulatedLampsAreDistantUnlessTheSceneIsNear) {
    const auto rig = [](const std::string& scene) {
        return parse_rig(with("width = 320", "scene = \"" + scene + "\""), "rig.toml");
    };
    EXPECT_TRUE(rig("torus-moss").distant_lamps);
    EXPECT_FALSE(rig("torus-moss-near").distant_lamps);
    EXPECT_FALSE(rig("torus-moss").camera.distance_mm);
    EXPECT_EQ(rig("torus-perspective").camera.distance_mm, rig("torus-perspective").sim.camera_distance_mm);
}

std::string lamps_toml(int count) {
    std::string toml = "[rig]\nname = \"r\"\n[lamps]\n";
    for (int i = 0; i < count; ++i)
        toml += "[[lamps.lamp]]\nname = \"l" + std::to_string(i) + "\"\nchannel = " + std::to_string(i % 64) +
                "\nposition_mm = [0, 0, 900]\n";
    return toml;
}

TEST(RigLamps, ThereAreOneToSixtyFour) {
    EXPECT_EQ(parse_rig(lamps_toml(1), "rig.toml").lamps.size(), 1);
    EXPECT_EQ(parse_rig(lamps_toml(64), "rig.toml").lamps.size(), 64);
    EXPECT_THAT(error_of(lamps_toml(0)), testing::HasSubstr("rig.toml:3: [lamps] holds no lamp; allowed: 1 to 64"));
    EXPECT_THAT(error_of(lamps_toml(65)), testing::HasSubstr("rig.toml:261: [[lamps.lamp]] is one of 65 lamps"));
    EXPECT_THAT(error_of("[rig]\nname = \"r\"\n"), testing::HasSubstr("has no [lamps]"));
}

TEST(RigText, HostileTextIsAnErrorInWords) {
    EXPECT_NE(error_of(std::string(2 << 20, '\n')), "no error");
    EXPECT_NE(error_of(std::string(5000, '[')), "no error") << "nesting";
    EXPECT_NE(error_of("a = " + std::string(5000, '[')), "no error") << "nesting";
    EXPECT_NE(error_of(std::string("[rig]\nname = \"\0\"", 16)), "no error") << "a NUL byte";
    EXPECT_NE(error_of("\xff\xfe"), "no error") << "not UTF-8";
    EXPECT_LT(error_of(with("tries = 3", std::string(100'000, 'k') + " = 3")).size(), 1000) << "an endless key";
    EXPECT_NE(error_of(""), "no error");
}

TEST(RigText, EveryTruncationIsAnErrorOrARig) {
    const std::string toml = good;
    for (std::size_t size = 0; size < toml.size(); ++size) {
        const std::string message = error_of(toml.substr(0, size));
        if (message != "no error") {
            EXPECT_THAT(message, testing::StartsWith("rig.toml:"));
        }
    }
}

TEST(RigText, WindowsLineEndingsAreRead) {
    std::string toml = good;
    for (std::size_t at = 0; (at = toml.find('\n', at)) != std::string::npos; at += 2) toml.replace(at, 1, "\r\n");
    EXPECT_EQ(parse_rig(toml, "rig.toml").lamps.size(), 2);
}

}  // namespace
}  // namespace darkbox
