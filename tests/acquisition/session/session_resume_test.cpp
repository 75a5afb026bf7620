#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "acquisition/device/unique_fd.h"
#include "tests/acquisition/session/session_fixture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::AllOf;
using testing::HasSubstr;

class Resume : public testing::Test {
protected:
    TemporaryFolder temporary;
    fs::path folder = temporary.path() / "session";
    fs::path journal = folder / "journal.jsonl";
};

void expect_numbered(const fs::path& folder, const std::vector<FrameRecord>& frames, std::size_t count) {
    ASSERT_EQ(frames.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(frames[i].sequence, i);
        EXPECT_TRUE(has_right_bits(folder, frames[i])) << frames[i].file;
    }
}

TEST_F(Resume, GoesOnWithEverythingThatWasAcknowledged) {
    std::vector<FrameRecord> before;
    {
        const SessionWriter writer = written_session(folder, 3);
        before = writer.acknowledged();
    }
    SessionWriter writer = SessionWriter::resume(folder);
    EXPECT_EQ(writer.acknowledged(), before);
    EXPECT_EQ(writer.info().object, "a brick");
    add_numbered(writer, 3);
    const Session session = writer.seal();
    expect_numbered(folder, session.frames(), 4);
    EXPECT_EQ(session.events().size(), 1u);
    EXPECT_EQ(session.info().notes.size(), 2u);
    EXPECT_EQ(session.extras().size(), 2u);
    session.verify();
}

TEST_F(Resume, AJournalTornAtAnyByteLosesOnlyTheTornLine) {
    {
        const SessionWriter writer = written_session(folder, 2);
    }
    {
        SessionWriter writer = SessionWriter::resume(folder);
        add_numbered(writer, 2);
    }
    const std::string whole = read_file(journal);
    const std::size_t last_line = whole.rfind('\n', whole.size() - 2) + 1;
    const fs::path torn = temporary.path() / "torn";
    for (std::size_t length = last_line; length < whole.size(); ++length) {
        copy_folder(folder, torn);
        write_file(torn / "journal.jsonl", whole.substr(0, length));
        SessionWriter writer = SessionWriter::resume(torn);
        ASSERT_EQ(writer.acknowledged().size(), 2u) << length;
        ASSERT_EQ(read_file(torn / "journal.jsonl"), whole.substr(0, last_line)) << length;
        ASSERT_FALSE(fs::exists(torn / "data/frames/0002_lamp-2.tif")) << length;
        if (length % 50 == 0) {
            add_numbered(writer, 2);
            const Session session = writer.seal();
            expect_numbered(torn, session.frames(), 3);
            session.verify();
        }
    }
}

TEST_F(Resume, ALastLineOfZerosIsTorn) {
    {
        const SessionWriter writer = written_session(folder, 2);
    }
    const std::string whole = read_file(journal);
    write_file(journal, whole + std::string(700, '\0'));
    EXPECT_EQ(SessionWriter::resume(folder).acknowledged().size(), 2u);
    write_file(journal, whole + std::string(700, '\0') + "}\n");
    EXPECT_EQ(SessionWriter::resume(folder).acknowledged().size(), 2u);
    EXPECT_EQ(read_file(journal), whole);
}

TEST_F(Resume, ADamagedLineIsAnErrorAndNothingIsRemoved) {
    {
        const SessionWriter writer = written_session(folder, 3);
    }
    const std::string whole = read_file(journal);
    const std::size_t second = whole.find('\n') + 1;
    for (const std::size_t at : {std::size_t{0}, second, whole.size() - 2}) {
        std::string damaged = whole;
        damaged[at] = '#';
        write_file(journal, damaged);
        EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("journal.jsonl line"));
        EXPECT_TRUE(fs::exists(folder / "data/frames/0002_lamp-2.tif"));
    }
    for (const char* nothing : {"", "{\"schema_version\": 1"}) {
        write_file(journal, nothing);
        EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("journal.jsonl"));
    }
}

TEST_F(Resume, WhatWasNotAcknowledgedIsRemoved) {
    {
        const SessionWriter writer = written_session(folder, 2);
    }
    fs::create_directories(folder / "data/given");
    for (const char* file : {"data/frames/0002_lamp-2.tif", "data/frames/.partial", "data/session.json",
                             "data/given/lights.lp", ".partial"})
        write_file(folder / file, "half a fil");
    fs::create_symlink(folder / "data/rig.toml", folder / "data/link");
    SessionWriter writer = SessionWriter::resume(folder);
    for (const char* file : {"data/frames/0002_lamp-2.tif", "data/frames/.partial", "data/session.json",
                             "data/given/lights.lp", ".partial", "data/link"})
        EXPECT_FALSE(fs::exists(fs::symlink_status(folder / file))) << file;
    EXPECT_TRUE(fs::exists(folder / "data/rig.toml"));
    add_numbered(writer, 2);
    writer.seal().verify();
}

TEST_F(Resume, AnAcknowledgedFileThatIsNotAsItWasIsNamed) {
    {
        const SessionWriter writer = written_session(folder, 3);
    }
    const fs::path victim = folder / "data/frames/0001_lamp-1.tif";
    const std::string good = read_file(victim);
    const auto failure = [&] { return failure_of<InputError>([&] { SessionWriter::resume(folder); }); };

    std::string flipped = good;
    flipped[good.size() / 2] ^= 1;
    write_file(victim, flipped);
    EXPECT_THAT(failure(), AllOf(HasSubstr(victim.string()), HasSubstr("checksum")));
    write_file(victim, good.substr(1));
    EXPECT_THAT(failure(), AllOf(HasSubstr(victim.string()), HasSubstr("size")));
    fs::remove(victim);
    EXPECT_THAT(failure(), AllOf(HasSubstr(victim.string()), HasSubstr("missing")));
    write_file(temporary.path() / "elsewhere.tif", good);
    fs::create_symlink(temporary.path() / "elsewhere.tif", victim);
    EXPECT_THAT(failure(), AllOf(HasSubstr(victim.string()), HasSubstr("link")));
    write_file(victim, good);
    expect_numbered(folder, SessionWriter::resume(folder).acknowledged(), 3);
}

TEST_F(Resume, ASealCutShortAnywhereIsSealedAgain) {
    {
        const SessionWriter writer = written_session(folder, 2);
    }
    const fs::path sealed = temporary.path() / "sealed";
    copy_folder(folder, sealed);
    SessionWriter::resume(sealed).seal();

    const std::vector<std::string> in_order{"data/session.json", "bag-info.txt", "bagit.txt", "manifest-sha256.txt",
                                            "tagmanifest-sha256.txt"};
    const fs::path cut = temporary.path() / "cut";
    for (std::size_t done = 0; done <= in_order.size(); ++done) {
        copy_folder(folder, cut);
        for (std::size_t i = 0; i < done; ++i) fs::copy_file(sealed / in_order[i], cut / in_order[i]);
        if (done < in_order.size()) {
            EXPECT_THAT(failure_of<InputError>([&] { Session::open(cut); }),
                        AllOf(HasSubstr("not sealed"), HasSubstr("darkbox capture --resume " + cut.string())));
            SessionWriter::resume(cut).seal();
        } else {  // everything but the removal of the journal
            ASSERT_TRUE(fs::exists(cut / "journal.jsonl"));
            Session::open(cut).verify();
            EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(cut); }), HasSubstr("sealed already"));
        }
        EXPECT_FALSE(fs::exists(cut / "journal.jsonl"));
        const Session session = Session::open(cut);
        expect_numbered(cut, session.frames(), 2);
        session.verify();
    }
}

TEST_F(Resume, ThereMustBeAnInterruptedSession) {
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("no interrupted session"));
    fs::create_directories(folder);
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("no interrupted session"));
    EXPECT_TRUE(fs::is_empty(folder));
    written_session(folder, 1).seal();
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("sealed already"));
    Session::open(folder).verify();
}

/// Adds frames for ever and tells each acknowledged number through the pipe, until it is killed.
[[noreturn]] void add_until_killed(const fs::path& folder, int pipe) {
    try {
        SessionWriter writer = SessionWriter::resume(folder);
        while (true) {
            const auto number = static_cast<std::uint32_t>(writer.acknowledged().size());
            add_numbered(writer, number);
            if (::write(pipe, &number, sizeof number) != sizeof number) ::_exit(2);
        }
    } catch (...) {
        ::_exit(3);
    }
}

struct KilledRun {
    std::vector<std::uint32_t> told;
    int signal = 0;
};

KilledRun run_and_kill(const fs::path& folder, std::chrono::microseconds delay) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) throw std::runtime_error("pipe");
    UniqueFd in(ends[0]);
    UniqueFd out(ends[1]);
    const pid_t child = ::fork();
    if (child == 0) add_until_killed(folder, out.get());
    out.reset();
    KilledRun result;
    std::uint32_t number = 0;
    // The clock starts at the first frame, so that the kill hits the loop however slow the machine is.
    if (::read(in.get(), &number, sizeof number) == sizeof number) result.told.push_back(number);
    std::this_thread::sleep_for(delay);
    ::kill(child, SIGKILL);
    while (::read(in.get(), &number, sizeof number) == sizeof number) result.told.push_back(number);
    int status = 0;
    ::waitpid(child, &status, 0);
    result.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    return result;
}

TEST_F(Resume, SigkillAtAnyMomentLosesNothingAcknowledged) {
    {
        const SessionWriter writer = SessionWriter::create(folder, capture_info(0));
    }
    Random random(2026);
    std::size_t told = 0;
    for (int attempt = 0; attempt < 30; ++attempt) {
        const KilledRun killed = run_and_kill(folder, std::chrono::microseconds(random.next() % 20'000));
        ASSERT_EQ(killed.signal, SIGKILL);
        ASSERT_FALSE(killed.told.empty());
        told = killed.told.back() + 1;
        const SessionWriter writer = SessionWriter::resume(folder);
        const std::vector<FrameRecord>& frames = writer.acknowledged();
        // One frame more may be there: killed between add()'s return and the report.
        ASSERT_GE(frames.size(), told) << "attempt " << attempt;
        ASSERT_LE(frames.size(), told + 1) << "attempt " << attempt;
        expect_numbered(folder, frames, frames.size());
    }
    const Session session = SessionWriter::resume(folder).seal();
    EXPECT_GE(session.frames().size(), told);
    session.verify();
}

}  // namespace
}  // namespace darkbox
