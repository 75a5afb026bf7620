// A camera that gives JPEGs alone: captured through the V4L2 driver with the kernel's answers scripted, kept as they
// came, and read by processing.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>

#include "acquisition/camera/v4l2_camera.h"
#include "acquisition/session/frame_file.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "rig/capture/capture_session.h"
#include "tests/acquisition/camera/fake_video_device.h"
#include "tests/acquisition/session/test_frames.h"
#include "tests/rig/capture/two_lamps.h"
#include "tests/support/jpeg_stream.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

constexpr int columns = 320, rows = 240;

/// Shares of full scale: each lamp lights its own side more.
double light_at(LampId lamp, int x) {
    const double towards = static_cast<double>(lamp.value == 0 ? columns - x : x) / columns;
    return 0.08 + 0.5 * towards;
}

class MjpgSession : public testing::Test {
protected:
    MjpgSession() {
        kernel.modes = {{V4L2_PIX_FMT_MJPEG, columns, rows, {{1, 50}}}};
        kernel.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, 3, 3}},
                           {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 200, 1, 50, 50}}};
        kernel.script = [this](test::FakeFrame& frame) {
            frame.bytes = picture();
            given[frame.sequence] = frame.bytes;
            if (fault) fault(frame);
        };
    }

    std::vector<std::byte> picture() {
        std::vector<unsigned char> rgb;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x) {
                const double noise = 0.002 * (static_cast<double>(random.next() % 1001) / 1000);
                const double light = noise + (lamps.lit ? light_at(*lamps.lit, x) : 0.0);
                rgb.insert(rgb.end(), 3, test::srgb_code(light));
            }
        return test::without_tables(test::jpeg_of(rgb, columns, rows));
    }

    CapturedSession capture(const std::string& format) {
        const RigDescription rig = parse_rig(
            "[rig]\nname = \"webcam\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"usb-Fake_0001-video-index0\"\n" +
                format +
                "exposure_ms = 10\n[lamps]\ndriver = \"gpio\"\n[lamps.gpio]\nchip = \"c\"\n"
                "[[lamps.lamp]]\nname = \"left\"\nline = \"1\"\nposition_mm = [-300, 0, 900]\n"
                "[[lamps.lamp]]\nname = \"right\"\nline = \"2\"\nposition_mm = [300, 0, 900]\n",
            "rig.toml");
        V4l2Options options;
        options.device = rig.camera.device;
        options.format = rig.camera.format;
        V4l2Camera camera(kernel, time, options);
        return capture_session({.folder = folder.path() / "s", .object = "cup", .lamps = {}}, rig, lamps, camera, time);
    }

    test::TemporaryFolder folder;
    test::FakeTime time;
    test::FakeVideoDevice kernel{time};
    test::Random random{7};
    std::map<std::uint64_t, std::vector<std::byte>> given;  ///< by the driver's count
    std::function<void(test::FakeFrame&)> fault;
    test::TwoLamps lamps;
};

std::vector<std::byte> bytes_in(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

TEST_F(MjpgSession, KeepsTheCamerasOwnBytesAndProcessingReadsThem) {
    const Session session = capture("format = \"MJPG\"\n").session;
    session.verify();
    ASSERT_EQ(session.frames().size(), 4U);
    for (const FrameRecord& record : session.frames()) {
        EXPECT_EQ(record.format, "mjpg");
        EXPECT_TRUE(record.file.ends_with(".jpg")) << record.file;
        EXPECT_TRUE(record.verified) << record.verification;
        EXPECT_EQ(bytes_in(session.path_of(record)), given.at(record.sequence)) << record.file;
        EXPECT_EQ(read_frame(session.path_of(record), record).jpeg, given.at(record.sequence));
    }
    const std::vector<Radiance> found = read_radiances(session, photographs_of(session, FrameKind::lit), {});
    ASSERT_EQ(found.size(), 2U);
    for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp) {
        double worst = 0, mean = 0;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x)
                for (int c = 0; c < 3; ++c) {
                    const double error = found[lamp].image(y, x)[c] - light_at(LampId{lamp}, x);
                    worst = std::max(worst, std::abs(error));
                    mean += error / (3.0 * rows * columns);
                }
        EXPECT_LT(worst, 0.02) << "eight bits behind sRGB's curve, and what the JPEG lost";
        EXPECT_LT(std::abs(mean), 0.001);
    }
}

TEST_F(MjpgSession, TakesDamagedPicturesAgain) {
    int frames = 0;
    fault = [&](test::FakeFrame& frame) {
        ++frames;
        if (frames == 4) frame.bytes.resize(frame.bytes.size() / 2);
        if (frames == 10) frame.bytes.assign(2000, std::byte{0});
    };
    const auto [session, summary, findings] = capture("format = \"MJPG\"\n");
    session.verify();
    EXPECT_EQ(summary.repeated, 2) << "both faults met frames that were wanted";
    EXPECT_EQ(session.frames().size(), 4U);
    for (const FrameRecord& record : session.frames())
        EXPECT_EQ(bytes_in(session.path_of(record)), given.at(record.sequence));
}

/// Nobody gets JPEGs who did not ask for them.
TEST_F(MjpgSession, HasToBeAskedFor) {
    try {
        (void)capture("");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("no picture format to measure with"));
        EXPECT_THAT(error.hint(), HasSubstr("format = \"MJPG\""));
    }
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "s"));
}

}  // namespace
}  // namespace darkbox
