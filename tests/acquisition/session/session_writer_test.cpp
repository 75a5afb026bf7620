#include "acquisition/session/session_writer.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdio>

#include "acquisition/session/sha256.h"
#include "tests/acquisition/session/session_fixture.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::AllOf;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::MatchesRegex;

/// Exit status of a shell command; 0 is good.
int run(const std::string& command) {
    std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    std::string output;
    for (int c; (c = std::fgetc(pipe)) != EOF;) output.push_back(static_cast<char>(c));
    const int status = ::pclose(pipe);
    if (status != 0) std::fputs(output.c_str(), stderr);
    return status;
}

class Writer : public testing::Test {
protected:
    TemporaryFolder temporary;
    fs::path folder = temporary.path() / "session";
};

TEST_F(Writer, EveryPixelFormatComesBackBitForBit) {
    SessionWriter writer = SessionWriter::create(folder, capture_info(4));
    std::vector<Frame> frames;
    for (const auto format : {PixelFormat::grey8, PixelFormat::grey16, PixelFormat::rgb8, PixelFormat::rgb16}) {
        frames.push_back(noise_frame(format, 33, 21, frames.size()));
        writer.add(frames.back(), numbered_record(static_cast<std::uint32_t>(frames.size())));
    }
    const std::vector<FrameRecord> acknowledged = writer.acknowledged();
    const Session session = writer.seal();
    ASSERT_EQ(session.frames(), acknowledged);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const FrameRecord& record = session.frames()[i];
        const Frame back = read_frame(session.path_of(record), record);
        EXPECT_EQ(back.pixels, frames[i].pixels);
        EXPECT_EQ(back.format, frames[i].format);
        EXPECT_EQ(back.bit_depth, frames[i].bit_depth);
        EXPECT_EQ(back.black_level, frames[i].black_level);
        EXPECT_EQ(back.sequence, frames[i].sequence);
        EXPECT_EQ(back.timestamp, frames[i].timestamp);
        EXPECT_EQ(back.controls.exposure, frames[i].controls.exposure);
        EXPECT_EQ(back.controls.gain, frames[i].controls.gain);
    }
    session.verify();
}

TEST_F(Writer, TheSessionSaysAllThatWasPutIn) {
    SessionWriter writer = written_session(folder, 3);
    FrameRecord dark;
    dark.kind = FrameKind::dark;
    dark.transfer = TransferCurve::srgb;
    writer.add(numbered_frame(7), dark);
    const Session session = writer.seal();
    EXPECT_EQ(session.info().object, "a brick");
    EXPECT_EQ(session.info().created, "2026-01-31T12:00:00.000Z");
    EXPECT_EQ(session.info().source, "capture");
    EXPECT_EQ(session.info().rig, "dome-12");
    EXPECT_EQ(session.info().camera, "sim 0001");
    EXPECT_EQ(session.info().planned_shots, 3);
    EXPECT_THAT(session.info().notes, ElementsAre("first note", "second note"));
    ASSERT_EQ(session.events().size(), 1u);
    EXPECT_EQ(session.events()[0].what, "lamp-3 taken again");
    EXPECT_THAT(session.extras(), ElementsAre("masks/mask.png", "rig.toml"));
    EXPECT_EQ(read_file(session.path_of_extra("rig.toml")), "[rig]\nname = \"dome-12\"\n");

    ASSERT_EQ(session.frames().size(), 4u);
    const FrameRecord& lit = session.frames()[2];
    EXPECT_EQ(lit.file, "frames/0002_lamp-2.tif");
    EXPECT_EQ(lit.kind, FrameKind::lit);
    EXPECT_EQ(lit.lamp, LampId{2});
    EXPECT_EQ(lit.lamp_on_ns, 1002);
    EXPECT_EQ(lit.lamp_off_ns, 2002);
    EXPECT_TRUE(lit.verified);
    EXPECT_EQ(lit.verification, "brighter than dark by 0.25");
    EXPECT_EQ(session.frames()[3].file, "frames/0003_dark.tif");
    EXPECT_EQ(session.frames()[3].kind, FrameKind::dark);
    EXPECT_EQ(session.frames()[3].transfer, TransferCurve::srgb);
    EXPECT_EQ(session.frames()[3].lamp, std::nullopt);
}

TEST_F(Writer, ImportedPicturesKeepTheirBytesAndNames) {
    SessionWriter writer = SessionWriter::create(folder, capture_info(1));
    FrameRecord record = numbered_record(0);
    record.file = "frames/cat.00.png";
    record.format = "png";
    record.width = 640;
    record.height = 480;
    record.bit_depth = 8;
    record.transfer = TransferCurve::srgb;
    writer.add(bytes_of("any bytes at all"), record);
    const Session session = writer.seal();
    record.sha256 = session.frames()[0].sha256;
    EXPECT_EQ(session.frames()[0], record);
    EXPECT_EQ(read_file(session.path_of(record)), "any bytes at all");
    EXPECT_EQ(record.sha256, sha256_hex(bytes_of("any bytes at all")));
}

TEST_F(Writer, ASealedSessionIsABagThatOtherToolsAccept) {
    SessionWriter writer = written_session(folder, 12);
    for (const char* name : {"given/two words.lp", "given/back\\slash.txt", "given/\xC3\xA9t\xC3\xA9.txt"})
        writer.add_extra(name, bytes_of(name));
    writer.seal();
    EXPECT_EQ(run("cd '" + folder.string() + "' && sha256sum -c --strict --quiet manifest-sha256.txt"), 0);
    EXPECT_EQ(run("cd '" + folder.string() + "' && sha256sum -c --strict --quiet tagmanifest-sha256.txt"), 0);
    EXPECT_EQ(read_file(folder / "bagit.txt"), "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n");

    std::uintmax_t bytes = 0;
    int files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "data"))
        if (entry.is_regular_file()) bytes += entry.file_size(), ++files;
    const std::string info = read_file(folder / "bag-info.txt");
    EXPECT_THAT(info, HasSubstr("Payload-Oxum: " + std::to_string(bytes) + "." + std::to_string(files) + "\n"));
    EXPECT_THAT(info, ContainsRegex("Bagging-Date: [0-9]{4}-[0-9]{2}-[0-9]{2}\n"));
    EXPECT_THAT(info, HasSubstr("External-Description: "));
}

TEST_F(Writer, OddNamesArePercentEncodedInTheManifest) {
    SessionWriter writer = written_session(folder, 1);
    for (const char* name : {"given/100%.txt", "given/a%0Ab.txt", "given/new\nline.txt", "given/cr\r.txt"})
        writer.add_extra(name, bytes_of(name));
    const Session session = writer.seal();
    session.verify();
    EXPECT_THAT(session.extras(), ElementsAre("given/100%.txt", "given/a%0Ab.txt", "given/cr\r.txt",
                                              "given/new\nline.txt", "masks/mask.png", "rig.toml"));
    const std::string manifest = read_file(folder / "manifest-sha256.txt");
    for (const char* encoded : {"  data/given/100%25.txt\n", "  data/given/a%250Ab.txt\n",
                                "  data/given/new%0Aline.txt\n", "  data/given/cr%0D.txt\n"})
        EXPECT_THAT(manifest, HasSubstr(encoded));
}

TEST_F(Writer, PayloadIsReadOnlyAndNothingIsLeftOverOnceSealed) {
    written_session(folder, 2).seal();
    EXPECT_FALSE(fs::exists(folder / "journal.jsonl"));
    EXPECT_FALSE(fs::exists(folder / "writer.lock"));
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        EXPECT_NE(entry.path().filename(), ".partial");
        if (!entry.is_regular_file() || entry.path().parent_path() == folder) continue;
        struct stat status{};
        ASSERT_EQ(::stat(entry.path().c_str(), &status), 0);
        EXPECT_EQ(status.st_mode & 0222, 0u) << entry.path();
    }
}

TEST_F(Writer, NothingGoesIntoASealedSession) {
    SessionWriter writer = written_session(folder, 1);
    writer.seal();
    EXPECT_THROW(add_numbered(writer, 9), std::logic_error);
    EXPECT_THROW(writer.add_extra("x", {}), std::logic_error);
    EXPECT_THROW(writer.note_event("x"), std::logic_error);
    EXPECT_THROW(writer.add_note("x"), std::logic_error);
    EXPECT_THROW(writer.seal(), std::logic_error);
    Session::open(folder).verify();
}

TEST_F(Writer, AnIncompleteSessionIsNotSealed) {
    SessionWriter writer = SessionWriter::create(folder, capture_info(3));
    add_numbered(writer, 0);
    add_numbered(writer, 1);
    EXPECT_THAT(failure_of<InputError>([&] { writer.seal(); }),
                AllOf(HasSubstr("2 frames of 3"), HasSubstr("darkbox capture --resume")));
    add_numbered(writer, 2);
    writer.seal().verify();
}

TEST_F(Writer, AFolderWithSomethingElseInItIsRefused) {
    fs::create_directories(folder);
    write_file(folder / "thesis.tex", "precious");
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::create(folder, capture_info(1)); }),
                HasSubstr("not an empty folder"));
    EXPECT_EQ(read_file(folder / "thesis.tex"), "precious");
    EXPECT_NE(failure_of<InputError>([&] { SessionWriter::create(folder / "thesis.tex", capture_info(1)); }), "");
}

TEST_F(Writer, WhatAKilledCreateLeftBehindIsNoObstacle) {
    fs::create_directories(folder / "data" / "frames");
    write_file(folder / "writer.lock", "");
    write_file(folder / ".partial", "{\"schema");
    written_session(folder / "", 1).seal().verify();
}

TEST_F(Writer, OneWriterAtATime) {
    SessionWriter writer = written_session(folder, 1);
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::resume(folder); }), HasSubstr("another darkbox"));
    EXPECT_THAT(failure_of<InputError>([&] { SessionWriter::create(folder, capture_info(1)); }), HasSubstr("--resume"));
    SessionWriter moved = std::move(writer);
    EXPECT_NE(failure_of<InputError>([&] { SessionWriter::resume(folder); }), "");
    {
        const SessionWriter ended = std::move(moved);
    }
    EXPECT_EQ(SessionWriter::resume(folder).acknowledged().size(), 1u);
}

TEST_F(Writer, NamesThatLeadOutOfTheSessionAreRefused) {
    SessionWriter writer = written_session(folder, 1);
    const std::string before = read_file(folder / "journal.jsonl");
    const std::vector<std::string> bad{"",
                                       "/etc/passwd",
                                       "../x",
                                       "a/../../x",
                                       "a//b",
                                       "a/",
                                       ".hidden",
                                       "a/.hidden",
                                       "latin\xE9",
                                       "session.json",
                                       "masks/mask.png",  // taken
                                       std::string("nul\0x", 5),
                                       std::string(256, 'x')};
    for (const std::string& name : bad) {
        EXPECT_NE(failure_of<InputError>([&] { writer.add_extra(name, bytes_of("x")); }), "") << name;
        if (name.empty()) continue;  // a frame without a name is given one
        FrameRecord record = numbered_record(0);
        record.file = name;
        EXPECT_NE(failure_of<InputError>([&] { writer.add(numbered_frame(0), record); }), "") << name;
    }
    EXPECT_EQ(read_file(folder / "journal.jsonl"), before);
    writer.seal().verify();
}

TEST_F(Writer, ADamagedFrameIsNeverAcknowledged) {
    SessionWriter writer = written_session(folder, 1);
    Frame frame = numbered_frame(1);
    frame.status = FrameStatus::truncated;
    EXPECT_THROW(writer.add(frame, numbered_record(1)), InputError);
    frame = numbered_frame(1);
    frame.pixels.resize(10);
    EXPECT_THROW(writer.add(frame, numbered_record(1)), InputError);
    frame = numbered_frame(1);
    frame.black_level = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(failure_of<InputError>([&] { writer.add(frame, numbered_record(1)); }), HasSubstr("black_level"));
    EXPECT_EQ(writer.acknowledged().size(), 1u);
    writer.seal().verify();
}

TEST_F(Writer, TextThatIsNotUtf8IsKeptReadable) {
    SessionInfo info = capture_info(0);
    info.object = "caf\xE9\nsecond line";
    SessionWriter writer = SessionWriter::create(folder, info);
    writer.note_event("\xFF");
    writer.seal();
    const Session session = Session::open(folder);
    EXPECT_EQ(session.info().object, "caf\xEF\xBF\xBD\nsecond line");
    EXPECT_EQ(session.events()[0].what, "\xEF\xBF\xBD");
    session.verify();
}

TEST(Names, RoundTrip) {
    for (const auto kind : {FrameKind::lit, FrameKind::dark, FrameKind::ambient, FrameKind::flat, FrameKind::ball})
        EXPECT_EQ(frame_kind_from_name(name(kind)), kind);
    for (const auto curve : {TransferCurve::linear, TransferCurve::srgb})
        EXPECT_EQ(transfer_curve_from_name(name(curve)), curve);
    EXPECT_EQ(name(FrameKind::ambient), "ambient");
    EXPECT_EQ(name(TransferCurve::srgb), "srgb");
    EXPECT_EQ(frame_kind_from_name("Lit"), std::nullopt);
    EXPECT_EQ(transfer_curve_from_name(""), std::nullopt);
}

TEST(Names, TimeIsIso8601InUtc) {
    EXPECT_THAT(iso8601_now(), MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\\.[0-9]{3}Z"));
}

}  // namespace
}  // namespace darkbox
