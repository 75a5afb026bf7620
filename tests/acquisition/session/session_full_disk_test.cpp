#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <csignal>
#include <optional>

#include "acquisition/device/device_error.h"
#include "tests/acquisition/session/session_fixture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::HasSubstr;

/// While it lives no file may grow beyond this many bytes: write() fails with EFBIG as it would on a full disk, after
/// having written what still fitted.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit limit{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
    ~FileSizeLimit() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    using Handler = void (*)(int);
    Handler handler_;
    rlimit before_{};
};

/// A file system of its own that is quickly full.
class SmallDisk {
public:
    SmallDisk() { mounted_ = ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, "size=256k") == 0; }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    ~SmallDisk() {
        if (mounted_) ::umount2(folder_.path().c_str(), MNT_DETACH);
    }
    bool mounted() const { return mounted_; }
    const fs::path& path() const { return folder_.path(); }
    /// Leaves `bytes` free.
    void fill_up_to(std::uintmax_t bytes) const {
        const std::uintmax_t free = fs::space(path()).available;
        write_file(path() / "filler", std::string(free > bytes ? free - bytes : 0, 'x'));
    }
    void make_room() const { fs::remove(path() / "filler"); }

private:
    TemporaryFolder folder_;
    bool mounted_ = false;
};

std::string failure_while_limited(rlim_t bytes, const std::function<void()>& action) {
    const FileSizeLimit limit(bytes);
    return failure_of<DeviceError>(action);
}

void expect_complete(const Session& session, std::size_t count) {
    ASSERT_EQ(session.frames().size(), count);
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(session.frames()[i].sequence, i);
        EXPECT_TRUE(has_right_bits(session.folder(), session.frames()[i]));
    }
    session.verify();
}

class FullDisk : public testing::Test {
protected:
    TemporaryFolder temporary;
    fs::path folder = temporary.path() / "session";
};

TEST_F(FullDisk, AFrameThatDoesNotFitIsAClearErrorAndIsTakenAgain) {
    SessionWriter writer = written_session(folder, 2);
    const std::string failure = failure_while_limited(300, [&] { add_numbered(writer, 2); });
    EXPECT_THAT(failure, HasSubstr("write " + (folder / "data/frames").string()));
    EXPECT_THAT(failure, HasSubstr("too large"));
    EXPECT_EQ(writer.acknowledged().size(), 2u);
    EXPECT_FALSE(fs::exists(folder / "data/frames/.partial"));
    add_numbered(writer, 2);
    expect_complete(writer.seal(), 3);
}

TEST_F(FullDisk, AJournalLineThatDoesNotFitIsCutBackWhereverItStops) {
    SessionWriter writer = SessionWriter::create(folder, capture_info(0));
    const auto journal = [this] { return read_file(folder / "journal.jsonl"); };
    const std::size_t head = journal().size();
    add_numbered(writer, 0);
    const std::size_t line = journal().size() - head;
    std::uint32_t next = 1;
    for (const std::size_t room : {std::size_t{0}, std::size_t{1}, line / 2, line - 1}) {
        const std::string before = journal();
        const std::string failure = failure_while_limited(before.size() + room, [&] { add_numbered(writer, next); });
        EXPECT_THAT(failure, HasSubstr("journal.jsonl")) << room;
        EXPECT_EQ(journal(), before) << room;
        EXPECT_EQ(writer.acknowledged().size(), next);
        add_numbered(writer, next++);
        EXPECT_EQ(journal().size(), before.size() + line);
    }
    expect_complete(writer.seal(), next);
}

TEST_F(FullDisk, AWriterThatGivesUpLeavesAResumableSession) {
    {
        SessionWriter writer = written_session(folder, 4);
        const auto size = read_file(folder / "journal.jsonl").size();
        EXPECT_NE(failure_while_limited(size + 50, [&] { add_numbered(writer, 4); }), "");
    }
    SessionWriter writer = SessionWriter::resume(folder);
    EXPECT_EQ(writer.acknowledged().size(), 4u);
    add_numbered(writer, 4);
    expect_complete(writer.seal(), 5);
}

TEST_F(FullDisk, ASealThatDoesNotFitIsDoneLater) {
    SessionWriter writer = written_session(folder, 4);
    for (const rlim_t limit : {rlim_t{20}, rlim_t{100}, rlim_t{300}, rlim_t{1000}})
        EXPECT_NE(failure_while_limited(limit, [&] { writer.seal(); }), "") << limit;
    EXPECT_NE(failure_of<InputError>([&] { Session::open(folder); }), "");
    add_numbered(writer, 4);
    expect_complete(writer.seal(), 5);
}

TEST(FullTmpfs, CapturesUntilFullAndGoesOnWhenThereIsRoom) {
    const SmallDisk disk;
    if (!disk.mounted()) GTEST_SKIP() << "mounting a tmpfs is not permitted here";
    const fs::path folder = disk.path() / "session";
    SessionWriter writer = SessionWriter::create(folder, capture_info(0));
    disk.fill_up_to(64 * 1024);
    std::uint32_t taken = 0;
    const std::string failure = failure_of<DeviceError>([&] {
        for (; taken < 1000; ++taken) add_numbered(writer, taken);
    });
    EXPECT_THAT(failure, HasSubstr("No space left on device"));
    EXPECT_THAT(failure, HasSubstr("free space"));
    EXPECT_THAT(failure, HasSubstr(folder.string()));
    ASSERT_GT(taken, 3u);
    ASSERT_EQ(writer.acknowledged().size(), taken);
    EXPECT_THAT(failure_of<DeviceError>([&] { writer.seal(); }), HasSubstr("No space left"));

    {
        const SessionWriter ended = std::move(writer);
    }
    disk.make_room();
    SessionWriter resumed = SessionWriter::resume(folder);
    ASSERT_EQ(resumed.acknowledged().size(), taken);
    add_numbered(resumed, taken);
    expect_complete(resumed.seal(), taken + 1);
}

}  // namespace
}  // namespace darkbox
