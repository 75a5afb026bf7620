// Frames that are given up again, and sealed sessions whose frames were doubted at the end.
#include <gmock/gmock.h>

#include "tests/acquisition/session/session_fixture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

class Withdrawn : public testing::Test {
protected:
    static FrameRecord named(std::uint32_t number, const std::string& file) {
        FrameRecord record = numbered_record(number);
        record.file = file;
        return record;
    }
    SessionWriter three_frames() const {
        SessionWriter writer = SessionWriter::create(folder, capture_info(3));
        for (std::uint32_t i = 0; i < 3; ++i) writer.add(numbered_frame(i), named(i, file(i)));
        return writer;
    }
    static std::string file(std::uint32_t number) { return "frames/000" + std::to_string(number) + ".tif"; }

    TemporaryFolder temporary;
    fs::path folder = temporary.path() / "session";
};

TEST_F(Withdrawn, FramesMakeRoomForOthersOfTheirName) {
    SessionWriter writer = three_frames();
    writer.withdraw(file(1), "light came in");
    EXPECT_EQ(writer.acknowledged().size(), 2U);
    EXPECT_FALSE(fs::exists(folder / "data" / file(1)));
    EXPECT_THROW(writer.seal(), InputError) << "one is missing";
    writer.add(numbered_frame(7), named(7, file(1)));
    const Session session = writer.seal({file(0), file(1), file(2)});
    session.verify();
    ASSERT_EQ(session.frames().size(), 3U);
    EXPECT_EQ(session.frames()[1].sequence, 7U);
    EXPECT_TRUE(has_right_bits(folder, session.frames()[1]));
}

/// Wherever the journal was torn, what it does not know is removed, and what it knows is there.
TEST_F(Withdrawn, FramesStaySoOverACrashAtAnyByte) {
    {
        SessionWriter writer = three_frames();
        writer.withdraw(file(1), "light came in");
        writer.add(numbered_frame(7), named(7, file(1)));
    }
    const std::string whole = read_file(folder / "journal.jsonl");
    const std::size_t withdrawal = whole.find("{\"withdrawn\"");
    ASSERT_NE(withdrawal, std::string::npos);
    const fs::path torn = temporary.path() / "torn";
    for (std::size_t length = whole.find('\n', withdrawal) + 1; length <= whole.size(); length += 7) {
        copy_folder(folder, torn);
        write_file(torn / "journal.jsonl", whole.substr(0, length));
        SessionWriter writer = SessionWriter::resume(torn);
        const bool added = length == whole.size();
        EXPECT_EQ(writer.acknowledged().size(), added ? 3U : 2U);
        EXPECT_EQ(fs::exists(torn / "data" / file(1)), added);
        if (!added) writer.add(numbered_frame(8), named(8, file(1)));
        writer.seal().verify();
    }
}

TEST_F(Withdrawn, FramesMustBeThere) {
    SessionWriter writer = three_frames();
    writer.add_extra("rig.toml", bytes_of("rig"));
    EXPECT_THROW(writer.withdraw("frames/none.tif", ""), InputError);
    EXPECT_THROW(writer.withdraw("rig.toml", ""), InputError);
    EXPECT_EQ(writer.acknowledged().size(), 3U);
}

TEST_F(Withdrawn, AJournalThatWithdrawsWhatItDoesNotHaveIsDamaged) {
    {
        const SessionWriter writer = three_frames();
    }
    std::ofstream(folder / "journal.jsonl", std::ios::app) << "{\"withdrawn\":\"frames/none.tif\",\"why\":\"\"}\n";
    try {
        SessionWriter::resume(folder);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("no frame \"frames/none.tif\""));
    }
}

TEST_F(Withdrawn, DoubtsAreSealedWithTheirFrames) {
    const Session session = three_frames().seal({}, {{file(2), "it shows another lamp"}});
    session.verify();
    std::vector<bool> verified;
    for (const FrameRecord& record : session.frames()) verified.push_back(record.verified);
    EXPECT_THAT(verified, ElementsAre(true, true, false));
    EXPECT_EQ(session.frames()[2].verification, "it shows another lamp");
    EXPECT_EQ(Session::open(folder).frames(), session.frames());
}

}  // namespace
}  // namespace darkbox
