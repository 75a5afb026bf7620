#include <fmt/format.h>
#include <gmock/gmock.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "acquisition/camera/v4l2_camera.h"
#include "rig/capture/frame_source.h"
#include "tests/hil/machine.h"
#include "tests/hil/vivid.h"

namespace darkbox {
namespace {

using test::Vivid;
using testing::HasSubstr;

constexpr int width = 320, height = 180;

/// vivid's formats that darkbox can keep.
constexpr std::array fourccs{"GREY", "Y10",  "Y12",  "Y16",  "YUYV", "NV12", "RGB3", "BA81",
                             "GBRG", "GRBG", "RGGB", "BG10", "GB10", "BA10", "RG10", "BG12",
                             "GB12", "BA12", "RG12", "BYR2", "GB16", "GR16", "RG16"};

struct Colour {
    double r = 0, g = 0, b = 0;
};
/// From left to right, each an eighth of the picture.
constexpr std::array<Colour, 8> bars{Colour{1, 1, 1}, {1, 1, 0}, {0, 1, 1}, {0, 1, 0},
                                     {1, 0, 1},       {1, 0, 0}, {0, 0, 1}, {0, 0, 0}};

/// Of video (Rec. ITU-R BT.601), and of vivid's grey pictures (BT.709).
double luma(const Colour& c) { return 0.299 * c.r + 0.587 * c.g + 0.114 * c.b; }
double grey(const Colour& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

std::uint16_t sample(const Frame& frame, int x, int y, int channel = 0) {
    const auto index = static_cast<std::size_t>((y * frame.width + x) * channels(frame.format) + channel);
    const auto byte = [&](std::size_t i) { return std::to_integer<std::uint16_t>(frame.pixels.at(i)); };
    if (bytes_per_sample(frame.format) == 1) return byte(index);
    return static_cast<std::uint16_t>(byte(2 * index) | byte(2 * index + 1) << 8);
}

class VividBase : public testing::Test {
protected:
    void SetUp() override {
        DARKBOX_NEED_MACHINE();
        vivid.emplace();
    }

    V4l2Options options(const std::string& format = "GREY") const {
        return {.device = vivid->webcam(),
                .format = format,
                .width = width,
                .height = height,
                .frame_rate = 25.0,
                .crop = {}};
    }
    TimePoint soon() const { return clock.now() + std::chrono::seconds(5); }

    std::optional<Vivid> vivid;
    SystemClock clock;
    KernelVideoDevice device;
};

// One module for all formats: loading it takes longer than a frame.
class VividFormats : public VividBase {
protected:
    Frame frame_of(const std::string& fourcc) {
        V4l2Camera camera(device, clock, options(fourcc));
        camera.configure({.exposure = Seconds(0.04)});
        camera.start();
        return camera.next_frame(soon());
    }

    /// What another program gets from the same picture: the driver's bytes.
    std::vector<std::byte> bytes_of(std::string fourcc) const {
        fourcc.resize(4, ' ');
        test::must(
            fmt::format("v4l2-ctl -d {} -v 'width={},height={},pixelformat={}' --stream-mmap=2 --stream-count=1 "
                        "--stream-to=/dev/shm/frame",
                        vivid->webcam(), width, height, fourcc));
        const std::string text = test::text_of("/dev/shm/frame");
        std::vector<std::byte> bytes(text.size());
        std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
        return bytes;
    }
};

/// As in the kernel's documentation of NV12, two rows share one of chroma.
std::vector<std::byte> with_chroma_repeated(const std::vector<std::byte>& nv12) {
    std::vector<std::byte> samples;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            samples.push_back(nv12.at(static_cast<std::size_t>(y * width + x)));
            samples.push_back(nv12.at(static_cast<std::size_t>((height + y / 2) * width + x)));
        }
    return samples;
}

/// The sample's share of full scale, which of a mosaic's colours it is by the format's name, is what the bar has.
void expect_bars(const Frame& frame) {
    const double full = std::exp2(frame.bit_depth) - 1;
    for (int bar = 0; bar < 8; ++bar) {
        const Colour& c = bars.at(static_cast<std::size_t>(bar));
        const int x0 = bar * width / 8 + width / 16;
        for (int y = 90; y < 92; ++y)
            for (int x = x0; x < x0 + 2; ++x) {
                const double value = sample(frame, x, y);
                if (frame.format == PixelFormat::ycc8) {
                    const double chroma = x % 2 == 0 ? (c.b - luma(c)) / 1.772 : (c.r - luma(c)) / 1.402;
                    EXPECT_NEAR(value, 16 + 219 * luma(c), 2) << "luma of bar " << bar;
                    EXPECT_NEAR(sample(frame, x, y, 1), 128 + 224 * chroma, 2) << "chroma of bar " << bar;
                } else if (frame.format == PixelFormat::rgb8) {
                    EXPECT_NEAR(value, 255 * c.r, 2) << "bar " << bar;
                    EXPECT_NEAR(sample(frame, x, y, 1), 255 * c.g, 2) << "bar " << bar;
                    EXPECT_NEAR(sample(frame, x, y, 2), 255 * c.b, 2) << "bar " << bar;
                } else if (const auto pattern = mosaic(frame.format)) {
                    const bool red_row = y % 2 == pattern->red_row, red_column = x % 2 == pattern->red_column;
                    const double wanted = red_row && red_column ? c.r : !red_row && !red_column ? c.b : c.g;
                    EXPECT_NEAR(value / full, wanted, 0.02) << "bar " << bar << " at " << x << ", " << y;
                } else {
                    EXPECT_NEAR(value / full, grey(c), 0.02) << "bar " << bar;
                }
            }
    }
}

TEST_F(VividFormats, AreKeptAsTheDriverGivesThemAndShowItsBars) {
    vivid->set(Vivid::test_pattern, Vivid::colour_bars);
    for (const char* fourcc : fourccs) {
        SCOPED_TRACE(fourcc);
        const Frame frame = frame_of(fourcc);
        ASSERT_EQ(frame.status, FrameStatus::good);
        ASSERT_EQ(frame.width, width);
        ASSERT_EQ(frame.height, height);
        const std::vector<std::byte> bytes = bytes_of(fourcc);
        EXPECT_TRUE(frame.pixels == (std::string(fourcc) == "NV12" ? with_chroma_repeated(bytes) : bytes));
        expect_bars(frame);
    }
}

class VividCamera : public VividBase {
protected:
    std::string refusal(const V4l2Options& wanted) {
        try {
            V4l2Camera(device, clock, wanted).configure({.exposure = Seconds(0.04)});
        } catch (const InputError& error) {
            return error.what() + std::string(" / ") + error.hint();
        }
        ADD_FAILURE() << "no InputError";
        return {};
    }
};

TEST_F(VividCamera, AgreesOnWhatItHasAndNamesWhatItHasNot) {
    V4l2Options wanted = options("");
    wanted.frame_rate = 12.5;
    const CameraInfo info = V4l2Camera(device, clock, wanted).configure({.exposure = Seconds(0.04)});
    EXPECT_EQ(info.format, PixelFormat::grey16) << "the deepest that is nearest to a sensor";
    EXPECT_EQ(info.bit_depth, 16);
    EXPECT_EQ(info.width, width);
    EXPECT_NEAR(info.frame_period.count(), 0.08, 1e-6);

    wanted.frame_rate = 13;
    EXPECT_THAT(refusal(wanted), HasSubstr("frame_rate is 13, but"));
    wanted = options("H264");
    EXPECT_THAT(refusal(wanted), HasSubstr("no format that darkbox can keep"));
    wanted = options("MJPG");
    EXPECT_THAT(refusal(wanted), HasSubstr("\"MJPG\", which is none of"));
    wanted = options("Y10P");
    EXPECT_THAT(refusal(wanted), HasSubstr("the camera has YUYV, NV12, GREY, Y10, Y12, Y16, RGB3, BA81"));
    wanted = options();
    wanted.width = 400;
    EXPECT_THAT(refusal(wanted), HasSubstr("was asked for 400 x 180 GREY and delivers"));
    wanted = options();
    wanted.crop = {{0, 0, 100, 100}};
    EXPECT_THAT(refusal(wanted), HasSubstr("crop is [0, 0, 100, 100]"));
}

TEST_F(VividCamera, Crops) {
    V4l2Options wanted = options();
    wanted.device = vivid->hdmi();
    wanted.frame_rate.reset();
    wanted.crop = {{64, 32, width, height}};
    V4l2Camera camera(device, clock, wanted);
    camera.configure({.exposure = Seconds(0.04)});
    EXPECT_THAT(test::shell("v4l2-ctl -d " + vivid->hdmi() + " --get-selection=target=crop").text,
                HasSubstr("Left 64, Top 32, Width 320, Height 180"));
    camera.start();
    EXPECT_EQ(camera.next_frame(soon()).pixels.size(), static_cast<std::size_t>(width * height));
}

TEST_F(VividCamera, SettlesItsControlsAndReadsThemWithEveryFrame) {
    vivid->set(V4L2_CID_AUTOGAIN, 1);
    vivid->set(V4L2_CID_BRIGHTNESS, 200);
    V4l2Camera camera(device, clock, options());
    const CameraInfo info = camera.configure({.exposure = Seconds(0.04)});
    EXPECT_EQ(vivid->get(V4L2_CID_AUTOGAIN), 0);
    EXPECT_EQ(vivid->get(V4L2_CID_BRIGHTNESS), 128);
    EXPECT_EQ(vivid->get(V4L2_CID_GAIN), 0);
    EXPECT_THAT(info.notes, testing::Contains(HasSubstr("has no exposure_auto")));
    camera.start();
    EXPECT_EQ(camera.next_frame(soon()).controls.gain, 1.0);
    vivid->set(V4L2_CID_GAIN, 7);
    const auto moved = [&] { return camera.next_frame(soon()).controls.gain != 1.0; };
    EXPECT_TRUE(test::comes_true(moved)) << "another program's change is seen";
}

TEST_F(VividCamera, StampsAndCountsItsFrames) {
    V4l2Camera camera(device, clock, options());
    const CameraInfo info = camera.configure({.exposure = Seconds(0.04)});
    camera.start();
    const Frame first = camera.next_frame(soon());
    const double period = info.frame_period.count();
    TimePoint before = first.timestamp;
    std::uint64_t count = first.sequence;
    for (int i = 0; i < 20; ++i) {
        const Frame frame = camera.next_frame(soon());
        EXPECT_GT(frame.sequence, count);
        EXPECT_GT(frame.timestamp, before);
        EXPECT_LE(frame.exposure.end, clock.now());
        EXPECT_LT(frame.exposure.begin, frame.exposure.end);
        before = frame.timestamp;
        count = frame.sequence;
    }
    // An emulated driver is late for single frames, never for good.
    EXPECT_NEAR(to_seconds(before - first.timestamp), static_cast<double>(count - first.sequence) * period, period);
}

TEST_F(VividCamera, StampsThatLieInTheFutureAreNamed) {
    vivid->set(Vivid::timestamp_source, Vivid::end_of_frame);
    V4l2Camera camera(device, clock, options());
    FrameSource source(camera, clock, {.exposure = Seconds(0.04)}, {});
    try {
        source.first_after(clock.now(), soon());
        FAIL() << "no DeviceError";
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.what(), HasSubstr("claims to be exposed in the future"));
    }
}

TEST_F(VividCamera, CountsOnWhenTheDriversCounterWraps) {
    vivid->set(Vivid::wrap_sequence_number, 1);
    V4l2Options wanted = options();
    wanted.frame_rate = 60;
    V4l2Camera camera(device, clock, wanted);
    camera.configure({.exposure = Seconds(0.01)});
    camera.start();
    std::uint64_t last = camera.next_frame(soon()).sequence;
    EXPECT_GT(last, 0xffffff00U);
    while (last < 0x100000004) {
        const std::uint64_t sequence = camera.next_frame(soon()).sequence;
        ASSERT_GT(sequence, last);
        ASSERT_LT(sequence, last + 100);
        last = sequence;
    }
}

}  // namespace
}  // namespace darkbox
