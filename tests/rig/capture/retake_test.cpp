#include "rig/capture/retake.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "acquisition/device/device_error.h"
#include "acquisition/session/bag.h"
#include "tests/rig/capture/bench.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::Bench;
using test::files_of;
using testing::ElementsAre;
using testing::HasSubstr;

const FrameRecord& frame_named(const Session& session, const std::string& file) {
    for (const FrameRecord& record : session.frames())
        if (record.file == file) return record;
    throw std::runtime_error("no " + file);
}

/// Everything below a folder, byte for byte.
std::map<std::string, std::string> contents_of(const fs::path& folder) {
    std::map<std::string, std::string> contents;
    for (const std::string& file : files_below(folder)) {
        std::ifstream in(folder / file, std::ios::binary);
        contents[file] = std::string(std::istreambuf_iterator<char>(in), {});
    }
    return contents;
}

class RetakeTest : public testing::Test {
protected:
    RetakeTest() { old_.emplace(bench_.capture()); }

    CaptureRequest request(const std::vector<std::string>& lamps, const std::string& name = "again") const {
        CaptureRequest request = bench_.request();
        request.folder = bench_.folder.path() / name;
        request.lamps = lamps;
        request.object = "";
        request.retake = old_->folder();
        return request;
    }
    Session retake(const CaptureRequest& asked) {
        WorkContext work;
        work.stop = bench_.stop.get_token();
        return capture_session(asked, bench_.rig, bench_.lamps, bench_.camera, bench_.clock, work).session;
    }
    std::string refusal(const CaptureRequest& asked) {
        try {
            retake(asked);
        } catch (const InputError& error) {
            EXPECT_FALSE(error.hint().empty());
            EXPECT_FALSE(fs::exists(asked.folder)) << "a refused re-take leaves nothing behind";
            return error.what();
        }
        return "no error";
    }

    Bench bench_;
    std::optional<Session> old_;
};

TEST_F(RetakeTest, TakesOneLampAgainAndTheRestOver) {
    const auto before = contents_of(old_->folder());
    const Session session = retake(request({"lamp-02"}));
    session.verify();
    EXPECT_EQ(contents_of(old_->folder()), before) << "the old session is never edited";
    EXPECT_THAT(files_of(session),
                ElementsAre("frames/0000_dark.tif", "frames/0000_dark-2.tif", "frames/0001_lamp-01.tif",
                            "frames/0002_lamp-02.tif", "frames/0003_lamp-03.tif", "frames/0004_lamp-04.tif",
                            "frames/0005_dark.tif", "frames/0005_dark-2.tif"));
    EXPECT_EQ(session.info().object, "a cat");
    EXPECT_EQ(session.info().retakes, old_->reference());
    for (const FrameRecord& record : session.frames()) {
        const bool fresh =
            record.file.find("lamp-02") != record.file.npos || record.file.find("-2.tif") != record.file.npos;
        EXPECT_EQ(record.taken_over_from, fresh ? "" : "session") << record.file;
        if (!fresh) {
            EXPECT_EQ(record.sha256, frame_named(*old_, record.file).sha256);
        }
        const Frame frame = read_frame(session.path_of(record), record);
        const auto shares = test::lamps_in(frame, Bench::lamp_count);
        for (std::uint32_t lamp = 0; lamp < shares.size(); ++lamp)
            EXPECT_NEAR(shares[lamp], record.lamp == LampId{lamp} ? 1.0 : 0.0, 0.02) << record.file;
    }
    EXPECT_NE(frame_named(session, "frames/0002_lamp-02.tif").sha256,
              frame_named(*old_, "frames/0002_lamp-02.tif").sha256);
    EXPECT_THAT(test::events_of(session), HasSubstr("takes over 5 frames of session session, and takes lamp-02 again"));
}

TEST_F(RetakeTest, SharesTheBytesOnOneDisk) {
    const Session session = retake(request({"lamp-02"}));
    struct stat a{}, b{};
    ASSERT_EQ(::stat((old_->folder() / "data/frames/0001_lamp-01.tif").c_str(), &a), 0);
    ASSERT_EQ(::stat((session.folder() / "data/frames/0001_lamp-01.tif").c_str(), &b), 0);
    EXPECT_EQ(a.st_ino, b.st_ino);
    EXPECT_EQ(b.st_mode & 0222U, 0U) << "read-only under both names";
}

TEST_F(RetakeTest, StandsWithoutTheOldOne) {
    const Session session = retake(request({"lamp-02", "lamp-04"}));
    fs::remove_all(old_->folder());
    EXPECT_NO_THROW(Session::open(session.folder()).verify());
}

TEST_F(RetakeTest, MayBeTakenAgainItself) {
    const Session first = retake(request({"lamp-02"}));
    CaptureRequest asked = request({"lamp-03"}, "third");
    asked.retake = first.folder();
    const Session second = retake(asked);
    second.verify();
    EXPECT_EQ(second.info().retakes, first.reference());
    EXPECT_EQ(frame_named(second, "frames/0001_lamp-01.tif").taken_over_from, "session");
    EXPECT_EQ(frame_named(second, "frames/0002_lamp-02.tif").taken_over_from, "again");
    EXPECT_EQ(frame_named(second, "frames/0003_lamp-03.tif").taken_over_from, "");
    EXPECT_EQ(frame_named(second, "frames/0000_dark-3.tif").taken_over_from, "");
}

TEST_F(RetakeTest, IsCancelledAtAnyMomentAndResumes) {
    int resumed = 0;
    for (int moment = 0; moment < 60; moment += 3) {
        int calls = 0;
        bench_.lamps.hook = bench_.camera.hook = [&](const std::string&) {
            if (calls++ == moment) bench_.stop.request_stop();
        };
        CaptureRequest asked = request({"lamp-02", "lamp-03"}, "again-" + std::to_string(moment));
        bool cancelled = false;
        try {
            retake(asked);
        } catch (const Cancelled&) {
            cancelled = true;
        }
        bench_.lamps.hook = bench_.camera.hook = nullptr;
        bench_.stop = std::stop_source();
        if (!cancelled || !fs::exists(asked.folder)) continue;
        asked.start = CaptureStart::resume;
        asked.retake.reset();
        asked.lamps.clear();
        const Session session = retake(asked);
        session.verify();
        EXPECT_EQ(session.frames().size(), Bench::shots + 2);
        ++resumed;
    }
    EXPECT_GT(resumed, 3);
}

TEST_F(RetakeTest, IsRefusedForAnotherRig) {
    bench_.rig.name = "another";
    EXPECT_THAT(refusal(request({"lamp-02"})), HasSubstr("captured by rig 'simulated-4', and this is 'another'"));
}
TEST_F(RetakeTest, IsRefusedWhereALampStandsElsewhere) {
    bench_.rig.lamps[2].position_mm[0] += 1;
    EXPECT_THAT(refusal(request({"lamp-02"})), HasSubstr("stand elsewhere"));
}
TEST_F(RetakeTest, IsRefusedWhereALampHangsOnAnotherOutput) {
    std::swap(bench_.rig.lamps[2].channel, bench_.rig.lamps[3].channel);
    EXPECT_THAT(refusal(request({"lamp-02"})), HasSubstr("other outputs"));
}
TEST_F(RetakeTest, IsRefusedForAnotherCamera) {
    bench_.camera.id = "0002";
    EXPECT_THAT(refusal(request({"lamp-02"})),
                HasSubstr("captured with the camera fake (0001), and this is fake (0002)"));
}
TEST_F(RetakeTest, IsRefusedInAnotherMode) {
    bench_.camera.black_level = 32;
    EXPECT_THAT(refusal(request({"lamp-02"})), HasSubstr("bits above 64, and the camera now delivers"));
}
TEST_F(RetakeTest, IsRefusedWhenTheControlsComeOutOtherwise) {
    bench_.camera.gain_in_effect = 2;
    EXPECT_THAT(refusal(request({"lamp-02"})), HasSubstr("at gain 1, and the camera now sets 0.02 s at gain 2"));
}
TEST_F(RetakeTest, IsRefusedForLampsThatAreNotThere) {
    EXPECT_THAT(refusal(request({"lamp-09"})), HasSubstr("the rig has no lamp 'lamp-09'"));
}
TEST_F(RetakeTest, WantsToKnowWhichLampsWhenAllWereVerified) {
    EXPECT_THAT(refusal(request({})), HasSubstr("was verified"));
}
TEST_F(RetakeTest, KeepsTheExposure) {
    CaptureRequest asked = request({"lamp-02"});
    asked.exposure = ExposureChoice{Seconds(0.01)};
    EXPECT_THAT(refusal(asked), HasSubstr("keeps its session's exposure"));
}
TEST_F(RetakeTest, TakesNothingOverThatIsDamaged) {
    const fs::path file = old_->folder() / "data/frames/0004_lamp-04.tif";
    fs::permissions(file, fs::perms::owner_write, fs::perm_options::add);
    std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(5000).put('x');
    try {
        retake(request({"lamp-02"}));
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("0004_lamp-04.tif does not match its checksum"));
    }
}

}  // namespace
}  // namespace darkbox
