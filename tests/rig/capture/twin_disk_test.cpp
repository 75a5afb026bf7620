// The twin's disk fails in the midst of a session: at every write in turn, by name.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "acquisition/device/device_error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/disk_fault.h"
#include "acquisition/session/session_writer.h"
#include "tests/rig/capture/twin.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using test::Twin;
using testing::HasSubstr;

struct DiskFailure {
    const char* name;
    const char* words;
};

class TwinDisk : public testing::TestWithParam<DiskFailure> {
protected:
    fs::path folder() const { return folder_.path() / "vase"; }

    /// A capture of two lamps; `faults` of the disk.
    Session capture(const std::string& faults, CaptureStart start) {
        Twin twin(faults);
        twin.rig.sim.width = 48;
        twin.rig.sim.height = 36;
        sim::SimDisk& disk = twin.sim().disk();
        const FailingDisk failing(folder(), [&] { return disk.next_write(); });
        struct Count {
            sim::SimDisk& disk;
            std::uint64_t& writes;
            ~Count() { writes = disk.writes(); }
        } count{disk, writes_};
        const CaptureRequest request{.folder = folder(),
                                     .object = "vase",
                                     .lamps = start == CaptureStart::create
                                                  ? std::vector<std::string>{"lamp-02", "lamp-05"}
                                                  : std::vector<std::string>{},
                                     .start = start};
        try {
            Session session = twin.capture(request).session;
            EXPECT_TRUE(twin.sim().lamps().all_dark());
            return session;
        } catch (const Error&) {
            EXPECT_TRUE(twin.sim().lamps().all_dark());
            throw;
        }
    }

    /// The checksums of the frames that were acknowledged; each file is as it was then.
    std::map<std::string, std::string> acknowledged() const {
        std::map<std::string, std::string> frames;
        if (!fs::exists(folder() / "journal.jsonl")) return frames;
        const SessionWriter writer = SessionWriter::resume(folder());
        for (const FrameRecord& record : writer.acknowledged()) frames[record.file] = record.sha256;
        return frames;
    }

    test::TemporaryFolder folder_;
    std::uint64_t writes_ = 0;
};

TEST_P(TwinDisk, EndsInANamedErrorAndLosesNothingThatWasAcknowledged) {
    (void)capture("", CaptureStart::create);
    const std::uint64_t writes = writes_;
    EXPECT_GE(writes, 15U) << "a head, rig.toml, four frames and their lines, the bag's papers";
    std::size_t most_kept = 0;
    for (std::uint64_t write = 0; write < writes; ++write) {
        fs::remove_all(folder());
        const std::string fault = fmt::format("{}@{}", GetParam().name, write);
        try {
            (void)capture(fault, CaptureStart::create);
            FAIL() << fault << " was not noticed";
        } catch (const DeviceError& error) {
            EXPECT_THAT(error.what(), HasSubstr("write " + folder().string())) << fault;
            EXPECT_THAT(error.what(), HasSubstr(GetParam().words)) << fault;
            EXPECT_FALSE(error.hint().empty());
        }
        ASSERT_FALSE(is_sealed(folder())) << fault;
        const auto kept = acknowledged();
        most_kept = std::max(most_kept, kept.size());
        const bool begun = fs::exists(folder() / "journal.jsonl");
        const Session session = capture("", begun ? CaptureStart::resume : CaptureStart::create);
        session.verify();
        ASSERT_EQ(session.frames().size(), 4U) << fault;
        for (const FrameRecord& record : session.frames()) {
            EXPECT_TRUE(record.verified) << fault;
            if (const auto frame = kept.find(record.file); frame != kept.end()) {
                EXPECT_EQ(record.sha256, frame->second) << fault << ' ' << record.file;
            }
        }
    }
    EXPECT_EQ(most_kept, 4U) << "among them writes after the last frame";
}

INSTANTIATE_TEST_SUITE_P(Faults, TwinDisk,
                         testing::Values(DiskFailure{"failed-write", "Input/output error"},
                                         DiskFailure{"full-disk", "No space left on device"}),
                         [](const auto& failure) {
                             return std::string(failure.param.name) == "full-disk" ? "FullDisk" : "FailedWrite";
                         });

TEST(TwinDiskFaults, HitNothingBesidesTheSession) {
    const test::TemporaryFolder folder;
    int asked = 0;
    const FailingDisk failing(folder.path() / "vase", [&] {
        ++asked;
        return 5;
    });
    EXPECT_EQ(disk_fault_of(folder.path() / "vase" / "data" / "frames" / ".partial"), 5);
    EXPECT_EQ(disk_fault_of(folder.path() / "vase-2" / "journal.jsonl"), 0);
    EXPECT_EQ(disk_fault_of(folder.path() / "vase" / ".." / "cup"), 0);
    EXPECT_EQ(asked, 1);
}

}  // namespace
}  // namespace darkbox
