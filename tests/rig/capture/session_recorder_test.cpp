#include "rig/capture/session_recorder.h"

#include <gmock/gmock.h>

#include <filesystem>

#include "acquisition/device/device_error.h"
#include "rig/capture/capture_session.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

using std::chrono::milliseconds;
using test::Bench;

class SessionRecorderTest : public testing::Test {
protected:
    SessionRecorderTest()
        : writer(SessionWriter::create(
              bench.folder.path() / "session",
              session_info(bench.rig, bench.camera.configure({}), "a cat", plan_capture(bench.rig)))) {}

    Frame frame() {
        if (bench.camera.starts == 0) bench.camera.start();
        return bench.camera.next_frame(TimePoint::max());
    }
    static FrameRecord record(int number) {
        FrameRecord record;
        record.file = "frames/000" + std::to_string(number) + "_dark.tif";
        record.kind = FrameKind::dark;
        record.verified = true;
        return record;
    }

    Bench bench;
    SessionWriter writer;
};

TEST_F(SessionRecorderTest, WritesEverythingInOrder) {
    SessionRecorder recorder(writer);
    for (int i = 0; i < 6; ++i) recorder.add(frame(), record(i));
    recorder.note_event("done");
    recorder.finish();
    ASSERT_EQ(writer.acknowledged().size(), 6u);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(writer.acknowledged()[static_cast<std::size_t>(i)].file, record(i).file);
    EXPECT_GT(recorder.most_queued(), 0u);
}

TEST_F(SessionRecorderTest, ADestructorWritesWhatIsQueued) {
    {
        SessionRecorder recorder(writer);
        for (int i = 0; i < 4; ++i) recorder.add(frame(), record(i));
    }
    EXPECT_EQ(writer.acknowledged().size(), 4u);
}

TEST_F(SessionRecorderTest, TheQueueIsBounded) {
    const Frame sample = frame();
    RecorderLimits limits;
    limits.queued_bytes = 3 * sample.pixels.size();
    SessionRecorder recorder(writer, limits);
    for (int i = 0; i < 9; ++i) recorder.add(frame(), record(i));
    recorder.finish();
    EXPECT_LE(recorder.most_queued(), limits.queued_bytes);
    EXPECT_EQ(writer.acknowledged().size(), 9u);
}

TEST_F(SessionRecorderTest, TheQueueCountsTheCamerasOwnBytes) {
    Frame one = frame();
    one.jpeg.resize(1000);
    const std::size_t whole = one.pixels.size() + 1000;
    SessionRecorder recorder(writer);
    recorder.add(std::move(one), record(0));
    recorder.finish();
    EXPECT_EQ(recorder.most_queued(), whole);
}

TEST_F(SessionRecorderTest, AFailedWriteFailsTheCaptureAndKeepsWhatWasWritten) {
    SessionRecorder recorder(writer);
    recorder.add(frame(), record(0));
    FrameRecord bad = record(1);
    bad.file = "frames/../../escape.tif";
    recorder.add(frame(), bad);
    EXPECT_ANY_THROW({
        for (int i = 2; i < 2000; ++i) recorder.add(frame(), record(i % 8 + 2));
        recorder.finish();
    });
    EXPECT_ANY_THROW(recorder.finish());
    ASSERT_EQ(writer.acknowledged().size(), 1u) << "nothing is written after a failure";
}

}  // namespace
}  // namespace darkbox
