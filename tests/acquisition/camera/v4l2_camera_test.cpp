#include "acquisition/camera/v4l2_camera.h"

#include <gmock/gmock.h>

#include <cerrno>
#include <stdexcept>

#include "acquisition/frame/error.h"
#include "tests/acquisition/camera/fake_video_device.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using test::FakeControl;
using test::FakeFrame;
using testing::Contains;
using testing::HasSubstr;

/// A camera at hand that could be bought: everything automatic at power-up.
class V4l2CameraTest : public testing::Test {
protected:
    V4l2CameraTest() {
        kernel.modes = {{V4L2_PIX_FMT_MJPEG, 64, 48, {{1, 30}}},
                        {V4L2_PIX_FMT_YUYV, 64, 48, {{1, 30}}},
                        {V4L2_PIX_FMT_Y12, 32, 24, {{1, 100}, {1, 50}, {1, 25}}},
                        {V4L2_PIX_FMT_Y12, 64, 48, {{1, 50}, {1, 25}, {1, 5}}}};
        kernel.controls = {{V4L2_CID_EXPOSURE_AUTO, {0, 3, 1, 3, 3}},
                           {V4L2_CID_EXPOSURE_AUTO_PRIORITY, {0, 1, 1, 1, 1}},
                           {V4L2_CID_EXPOSURE_ABSOLUTE, {1, 5000, 1, 156, 156}},
                           {V4L2_CID_AUTO_WHITE_BALANCE, {0, 1, 1, 1, 1}},
                           {V4L2_CID_POWER_LINE_FREQUENCY, {0, 2, 1, 1, 1}},
                           {V4L2_CID_GAIN, {16, 255, 1, 64, 64}},
                           {V4L2_CID_BRIGHTNESS, {-64, 64, 1, 0, 20}},
                           {V4L2_CID_GAMMA, {72, 500, 1, 220, 220}},
                           {V4L2_CID_SHARPNESS, {0, 6, 1, 3, 3}}};
        options.device = kernel.path;
    }
    ~V4l2CameraTest() override { EXPECT_THAT(kernel.broken_rules, testing::IsEmpty()); }

    V4l2Camera& camera() {
        if (!camera_) camera_.emplace(kernel, time, options);
        return *camera_;
    }
    void start() {
        camera().configure({Seconds(0.02), 1.0});
        camera().start();
    }
    Frame next(Nanoseconds patience = milliseconds(1000)) { return camera().next_frame(time.now() + patience); }

    template <typename Failure, typename Act>
    static std::string failure(Act&& act) {
        try {
            act();
        } catch (const Failure& error) {
            EXPECT_FALSE(error.hint().empty()) << error.what();
            return error.what();
        }
        ADD_FAILURE() << "nothing was thrown";
        return "";
    }
    std::string configure_failure() {
        return failure<DeviceError>([&] { camera().configure({}); });
    }

    test::FakeTime time;
    test::FakeVideoDevice kernel{time};
    V4l2Options options;

private:
    std::optional<V4l2Camera> camera_;
};

TEST_F(V4l2CameraTest, TheBestFormatTheLargestPictureAndARateThatHoldsTheExposure) {
    const CameraInfo info = camera().configure({Seconds(0.03), 1.0});
    EXPECT_EQ(info.format, PixelFormat::grey16);
    EXPECT_EQ(info.bit_depth, 12);
    EXPECT_EQ(info.width, 64);
    EXPECT_EQ(info.height, 48);
    EXPECT_EQ(info.frame_period, Seconds(1.0 / 25));
    EXPECT_EQ(info.model, "Fake camera");
    EXPECT_EQ(info.id, kernel.path);
    EXPECT_THAT(info.notes, Contains(HasSubstr("Y12 of 64 x 48, 25.000 frames a second")));
}

TEST_F(V4l2CameraTest, WhatIsAskedForIsUsed) {
    options.format = "Y12";
    options.width = 32;
    options.height = 24;
    options.frame_rate = 50;
    const CameraInfo info = camera().configure({});
    EXPECT_EQ(info.frame_period, Seconds(0.02));
    EXPECT_EQ(info.width, 32);
}

TEST_F(V4l2CameraTest, OptionsOutOfRangeAreRefused) {
    options.buffers = 1;
    EXPECT_THAT(failure<InputError>([&] { camera(); }), HasSubstr("buffers is 1; allowed: 2 to 32"));
    options.buffers = 4;
    options.width = 64;
    EXPECT_THAT(failure<InputError>([&] { camera(); }), HasSubstr("give both or neither"));
}

TEST_F(V4l2CameraTest, FormatsThatTheCameraLacksAreRefused) {
    options.format = "GREY";
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("\"GREY\", which is none of"));
}

TEST_F(V4l2CameraTest, FormatsThatNobodyCanKeepAreRefused) {
    options.format = "H264";
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("no format that darkbox can keep"));
}

TEST_F(V4l2CameraTest, JpegsAreTakenWhereTheyAreAskedFor) {
    options.format = "MJPG";
    const CameraInfo info = camera().configure({});
    EXPECT_EQ(info.format, PixelFormat::mjpg);
    EXPECT_EQ(info.bit_depth, 16);
    camera().start();
    EXPECT_EQ(next().status, FrameStatus::truncated) << "the stand-in's bytes are no JPEG";
    camera().stop();
}

TEST_F(V4l2CameraTest, SizesThatTheCameraLacksAreRefused) {
    options.format = "Y12";
    options.width = options.height = 33;
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("delivers 64 x 48 MJPG"));
}

TEST_F(V4l2CameraTest, RatesThatTheCameraLacksAreRefused) {
    options.frame_rate = 40;
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("takes 50.000 frames a second"));
}

TEST_F(V4l2CameraTest, ACropIsReadBack) {
    kernel.crops = true;
    options.crop = {8, 8, 33, 16};
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("nearest: [8, 8, 32, 16]"));
}

TEST_F(V4l2CameraTest, ACropThatACameraCannotDoIsRefused) {
    options.crop = {8, 8, 32, 16};
    for (const int error : {ENOTTY, EINVAL, ENODATA}) {
        kernel.refuses_crop_with = error;
        EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("crop is [8, 8, 32, 16]"));
    }
}

TEST_F(V4l2CameraTest, EverythingAutomaticIsOffAndEveryImprovementNeutral) {
    const CameraInfo info = camera().configure({Seconds(0.0123), 2.0});
    const auto value = [&](std::uint32_t id) { return kernel.live_controls.at(id).value; };
    EXPECT_EQ(value(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
    EXPECT_EQ(value(V4L2_CID_EXPOSURE_AUTO_PRIORITY), 0);
    EXPECT_EQ(value(V4L2_CID_AUTO_WHITE_BALANCE), 0);
    EXPECT_EQ(value(V4L2_CID_POWER_LINE_FREQUENCY), 0);
    EXPECT_EQ(value(V4L2_CID_BRIGHTNESS), 0);
    EXPECT_EQ(value(V4L2_CID_GAMMA), 100);
    EXPECT_EQ(value(V4L2_CID_SHARPNESS), 0);
    EXPECT_EQ(value(V4L2_CID_EXPOSURE_ABSOLUTE), 123);
    EXPECT_EQ(value(V4L2_CID_GAIN), 32);
    EXPECT_DOUBLE_EQ(info.controls.exposure.count(), 0.0123);
    EXPECT_DOUBLE_EQ(info.controls.gain, 2.0);
    EXPECT_THAT(info.notes, Contains(HasSubstr("has no autogain")));
    EXPECT_THAT(info.notes, Contains(HasSubstr("focus_auto")));
}

/// Each control that is there and does not hold is an error by its name; none is left out.
TEST_F(V4l2CameraTest, AControlThatDoesNotHoldIsAnError) {
    const auto power_up = kernel.controls;
    for (const auto& [id, name] : {std::pair<std::uint32_t, const char*>{V4L2_CID_EXPOSURE_AUTO, "exposure_auto"},
                                   {V4L2_CID_EXPOSURE_AUTO_PRIORITY, "exposure_auto_priority"},
                                   {V4L2_CID_AUTO_WHITE_BALANCE, "auto_white_balance"},
                                   {V4L2_CID_POWER_LINE_FREQUENCY, "power_line_frequency"},
                                   {V4L2_CID_BRIGHTNESS, "brightness"},
                                   {V4L2_CID_GAMMA, "gamma"},
                                   {V4L2_CID_SHARPNESS, "sharpness"},
                                   {V4L2_CID_GAIN, "gain"},
                                   {V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_absolute"}}) {
        kernel.controls = power_up;
        kernel.controls[id].holds = false;
        kernel.plug_in();
        EXPECT_THAT(configure_failure(), testing::ContainsRegex(std::string("control ") + name + " of .* and reads"));
        kernel.controls = power_up;
        kernel.controls[id].flags = V4L2_CTRL_FLAG_READ_ONLY;
        kernel.plug_in();
        EXPECT_THAT(configure_failure(), HasSubstr(std::string("control ") + name)) << "read-only";
    }
}

TEST_F(V4l2CameraTest, InactiveControlsAreRecorded) {
    kernel.controls[V4L2_CID_SHARPNESS].flags = V4L2_CTRL_FLAG_INACTIVE;
    EXPECT_THAT(camera().configure({}).notes, Contains(HasSubstr("do nothing: sharpness")));
}

TEST_F(V4l2CameraTest, ExposureAndGainOutOfRangeAreRefused) {
    EXPECT_THAT(failure<InputError>([&] { camera().configure({Seconds(0.6), 1.0}); }),
                HasSubstr("exposure_ms is 600; " + kernel.path + " allows 0.1 to 500"));
    EXPECT_THAT(failure<InputError>([&] { camera().configure({Seconds(0.02), 17.0}); }), HasSubstr("gain is 17"));
    EXPECT_THAT(failure<InputError>([&] { camera().configure({Seconds(0.02), 0.5}); }), HasSubstr("gain is 0.5"));
}

TEST_F(V4l2CameraTest, AGainWithoutAUnitStaysAtItsLeast) {
    kernel.controls[V4L2_CID_GAIN] = {0, 100, 1, 50, 50};
    EXPECT_EQ(camera().configure({}).controls.gain, 1.0);
    EXPECT_EQ(kernel.live_controls.at(V4L2_CID_GAIN).value, 0);
    EXPECT_THAT(failure<InputError>([&] { camera().configure({Seconds(0.02), 2.0}); }), HasSubstr("gain is 2"));
}

TEST_F(V4l2CameraTest, WithoutAnExposureControlAFrameIsExposedForItsPeriod) {
    kernel.controls.erase(V4L2_CID_EXPOSURE_ABSOLUTE);
    EXPECT_EQ(camera().configure({}).controls.exposure, camera().configure({}).frame_period);
    EXPECT_THAT(camera().configure({}).notes, Contains(HasSubstr("exposure_absolute")));
}

TEST_F(V4l2CameraTest, FramesCarryTheirSamplesAndTheControlsInEffect) {
    kernel.padding = 6;
    kernel.script = [&](FakeFrame& frame) {
        for (std::size_t row = 0; row < 48; ++row)
            for (std::size_t i = 0; i < 128; ++i)
                frame.bytes[row * 134 + i] = static_cast<std::byte>(i % 2 == 0 ? row + frame.sequence : i % 15);
        if (frame.sequence == 1) kernel.live_controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 77;  // another program
    };
    start();
    const Frame first = next();
    EXPECT_EQ(first.status, FrameStatus::good);
    ASSERT_EQ(first.pixels.size(), 64u * 48 * 2);
    for (std::size_t i = 0; i < first.pixels.size(); ++i)
        ASSERT_EQ(first.pixels[i], static_cast<std::byte>(i % 2 == 0 ? i / 128 : i % 128 % 15)) << i;
    EXPECT_DOUBLE_EQ(first.controls.exposure.count(), 0.02);
    EXPECT_DOUBLE_EQ(next().controls.exposure.count(), 0.0077);
}

/// Far more frames than buffers: each comes back once, in order.
TEST_F(V4l2CameraTest, BuffersGoRound) {
    start();
    for (std::uint64_t i = 0; i < 50; ++i) EXPECT_EQ(next().sequence, i);
}

TEST_F(V4l2CameraTest, ExposureFollowsFromTheStampsMeaning) {
    const auto exposure = [&](const std::string& driver, std::uint32_t source) {
        kernel.driver = driver;
        kernel.script = [=](FakeFrame& frame) { frame.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | source; };
        start();
        const Frame frame = next();
        camera().stop();
        return std::pair(frame.exposure.begin - frame.timestamp, frame.exposure.end - frame.timestamp);
    };
    using Bounds = std::pair<Nanoseconds, Nanoseconds>;
    // The fake stamps 20 ms before it delivers; an end is never later than that.
    EXPECT_EQ(exposure("fake", V4L2_BUF_FLAG_TSTAMP_SRC_SOE), (Bounds{milliseconds(0), milliseconds(20)}));
    EXPECT_EQ(exposure("uvcvideo", V4L2_BUF_FLAG_TSTAMP_SRC_SOE), (Bounds{milliseconds(-20), milliseconds(20)}));
    EXPECT_EQ(exposure("fake", V4L2_BUF_FLAG_TSTAMP_SRC_EOF), (Bounds{milliseconds(-40), milliseconds(0)}));
}

TEST_F(V4l2CameraTest, AStampInTheFutureIsLeftForAllToSee) {
    kernel.script = [&](FakeFrame& frame) { frame.stamp += milliseconds(38); };
    start();
    EXPECT_GT(next().exposure.end, time.now());
}

TEST_F(V4l2CameraTest, StampsOfAnotherClockAreRefused) {
    for (const std::uint32_t kind : {V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN, V4L2_BUF_FLAG_TIMESTAMP_COPY}) {
        kernel.script = [=](FakeFrame& frame) { frame.flags = kind; };
        start();
        EXPECT_THAT(failure<DeviceError>([&] { next(); }), HasSubstr("not of the monotonic clock"));
        camera().stop();
    }
}

TEST_F(V4l2CameraTest, GapsErrorsAndShortFramesAreTold) {
    kernel.script = [](FakeFrame& frame) {
        frame.lost = frame.sequence == 1;
        if (frame.sequence == 2) frame.flags |= V4L2_BUF_FLAG_ERROR;
        if (frame.sequence == 3) frame.bytes.pop_back();
        if (frame.sequence == 4) frame.bytes.clear();
    };
    start();
    EXPECT_EQ(next().sequence, 0u);
    const Frame damaged = next();
    EXPECT_EQ(damaged.sequence, 2u);
    EXPECT_EQ(damaged.status, FrameStatus::error);
    EXPECT_EQ(next().status, FrameStatus::truncated);
    EXPECT_EQ(next().status, FrameStatus::truncated);
    EXPECT_EQ(next().status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, SequencesGoOnBehind32Bits) {
    kernel.script = [](FakeFrame& frame) {
        frame.sequence += 0xFFFFFFFEU;
        if (frame.sequence == 1) frame.sequence = 0;  // the fourth repeats the third
    };
    start();
    EXPECT_EQ(next().sequence, 0xFFFFFFFEu);
    EXPECT_EQ(next().sequence, 0xFFFFFFFFu);
    EXPECT_EQ(next().sequence, 0x100000000u);
    EXPECT_EQ(next().sequence, 0x100000000u);
    EXPECT_EQ(next().sequence, 0x100000002u);
}

TEST_F(V4l2CameraTest, AHangingCameraEndsAtTheDeadline) {
    kernel.mute = true;
    start();
    const TimePoint begin = time.now();
    EXPECT_THROW(next(milliseconds(300)), DeadlineError);
    EXPECT_EQ(time.now() - begin, milliseconds(300));
    kernel.mute = false;
    EXPECT_EQ(next().status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, AfterAnInputOutputErrorARestartGoesOn) {
    kernel.script = [](FakeFrame& frame) { frame.error = frame.sequence == 1 ? EIO : 0; };
    start();
    next();
    EXPECT_THAT(failure<DeviceError>([&] { next(); }), HasSubstr("VIDIOC_DQBUF " + kernel.path + ": Input/output"));
    camera().stop();
    camera().start();
    EXPECT_EQ(next().sequence, 0u);
}

TEST_F(V4l2CameraTest, RefusedStreamsAreErrorsThatATryLaterOvercomes) {
    camera().configure({});
    for (const unsigned long request : {VIDIOC_REQBUFS, VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON})
        for (const int error : {EINVAL, ENOSPC, EIO, EBUSY}) {
            kernel.errors[request] = {error};
            EXPECT_THROW(camera().start(), DeviceError);
            kernel.errors.clear();
        }
    camera().start();
    EXPECT_EQ(next().status, FrameStatus::good);
}

TEST_F(V4l2CameraTest, ABusWithoutBandwidthIsNotAFullDisk) {
    camera().configure({});
    kernel.errors[VIDIOC_STREAMON] = {ENOSPC};
    try {
        camera().start();
        ADD_FAILURE();
    } catch (const DeviceError& error) {
        EXPECT_THAT(error.hint(), HasSubstr("bandwidth"));
    }
}

TEST_F(V4l2CameraTest, AnUnpluggedCameraSaysSoAndComesBackAsItWas) {
    start();
    next();
    kernel.unplug();
    EXPECT_THAT(failure<CameraGone>([&] { next(); }), HasSubstr("was unplugged"));
    camera().stop();
    camera().start();
    EXPECT_THAT(failure<DeadlineError>([&] { next(milliseconds(500)); }), HasSubstr("waiting for the camera"));
    kernel.plug_in();
    const Frame frame = next();
    EXPECT_EQ(frame.status, FrameStatus::good);
    EXPECT_EQ(kernel.live_controls.at(V4L2_CID_EXPOSURE_AUTO).value, V4L2_EXPOSURE_MANUAL);
    EXPECT_DOUBLE_EQ(frame.controls.exposure.count(), 0.02);
}

TEST_F(V4l2CameraTest, UnpluggedWhileItWaits) {
    kernel.script = [&](FakeFrame& frame) {
        if (frame.sequence == 2 && kernel.opened == 1) kernel.unplug();
    };
    start();
    next();
    next();
    EXPECT_THROW(next(), CameraGone);
    kernel.plug_in();  // before the driver even looked
    camera().stop();
    camera().start();
    EXPECT_EQ(next().sequence, 0u);
}

TEST_F(V4l2CameraTest, AnotherCameraInItsPlaceIsRefusedEveryTime) {
    start();
    next();
    kernel.unplug();
    EXPECT_THROW(next(), CameraGone);
    camera().stop();
    camera().start();
    kernel.card = "Another camera";
    kernel.plug_in();
    for (int i = 0; i < 3; ++i)
        EXPECT_THAT(failure<InputError>([&] { next(); }), HasSubstr("came back as Another camera"));
}

TEST_F(V4l2CameraTest, AnAbsentCameraIsNamed) {
    options.device = "usb-None-video-index0";
    EXPECT_THAT(failure<CameraGone>([&] { camera().configure({}); }),
                HasSubstr("/dev/v4l/by-id/usb-None-video-index0"));
}

TEST_F(V4l2CameraTest, NodesThatAreNoCamerasAreRefused) {
    kernel.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("no single-planar capture device"));
    kernel.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
    EXPECT_THAT(failure<InputError>([&] { camera().configure({}); }), HasSubstr("cannot stream"));
}

/// Any call in a state it is not for is the caller's fault.
TEST_F(V4l2CameraTest, IllegalCalls) {
    EXPECT_THROW(camera().start(), std::logic_error);
    EXPECT_THROW(next(), std::logic_error);
    camera().stop();
    camera().configure({});
    EXPECT_THROW(next(), std::logic_error);
    camera().start();
    EXPECT_THROW(camera().start(), std::logic_error);
    EXPECT_THROW(camera().configure({}), std::logic_error);
    camera().stop();
    camera().stop();
    camera().configure({});
}

/// Whatever single call fails, and however: an error for people, and afterwards all is well again.
TEST_F(V4l2CameraTest, EveryCallMayFailOnce) {
    for (const unsigned long request : {VIDIOC_QUERYCAP, VIDIOC_S_FMT, VIDIOC_QUERYCTRL, VIDIOC_S_CTRL, VIDIOC_G_CTRL,
                                        VIDIOC_REQBUFS, VIDIOC_QUERYBUF, VIDIOC_QBUF, VIDIOC_STREAMON, VIDIOC_DQBUF})
        for (const int error : {EIO, ENOMEM, EPROTO}) {
            kernel.errors[request] = {error};
            EXPECT_THROW(
                {
                    start();
                    next();
                },
                DeviceError);
            kernel.errors.clear();
            camera().stop();
            start();
            EXPECT_EQ(next().status, FrameStatus::good);
            camera().stop();
        }
}

TEST(CameraIds, AreTheNamesInTheFolder) { EXPECT_THAT(camera_ids("/nonexistent"), testing::IsEmpty()); }

}  // namespace
}  // namespace darkbox
