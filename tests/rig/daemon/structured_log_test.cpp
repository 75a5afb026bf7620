#include "rig/daemon/structured_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <map>

#include "acquisition/device/unique_fd.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

/// A reader after the protocol's description (systemd.io/JOURNAL_NATIVE_PROTOCOL).
std::map<std::string, std::string> read_datagram(std::string_view data) {
    std::map<std::string, std::string> fields;
    while (!data.empty()) {
        const auto end = data.find('\n');
        const std::string_view line = data.substr(0, end);
        data.remove_prefix(end + 1);
        if (const auto equals = line.find('='); equals != line.npos) {
            fields.emplace(line.substr(0, equals), line.substr(equals + 1));
            continue;
        }
        std::uint64_t length = 0;
        for (int i = 7; i >= 0; --i)
            length = length << 8 | static_cast<unsigned char>(data[static_cast<std::size_t>(i)]);
        fields.emplace(line, data.substr(8, length));
        EXPECT_EQ(data.at(8 + length), '\n');
        data.remove_prefix(8 + length + 1);
    }
    return fields;
}

/// Stands for journald.
class FakeJournal {
public:
    FakeJournal() : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path().copy(address.sun_path, sizeof address.sun_path - 1);
        EXPECT_EQ(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    }
    std::string path() const { return (folder_.path() / "journal").string(); }
    /// What came, if anything did.
    std::map<std::string, std::string> next() const {
        std::array<char, 65536> buffer{};
        const ssize_t got = ::recv(fd_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
        return got < 0 ? std::map<std::string, std::string>()
                       : read_datagram({buffer.data(), static_cast<std::size_t>(got)});
    }

private:
    TemporaryFolder folder_;
    UniqueFd fd_;
};

const LogLine frame_taken{
    LogLevel::info, "frame taken", {{"session", "vase-1"}, {"lamp", "lamp-02"}, {"frame", "0003_lamp-02"}}};

TEST(StructuredLogTest, IsOneLineOfKeysAndValues) {
    EXPECT_EQ(key_value_line(frame_taken),
              R"(level=info msg="frame taken" session=vase-1 lamp=lamp-02 frame=0003_lamp-02)");
    EXPECT_EQ(key_value_line({LogLevel::error, "a=\"b\"\nc\\", {{"empty", ""}, {"word", "Ø"}}}),
              "level=error msg=\"a=\\\"b\\\"\\nc\\\\\" empty=\"\" word=Ø");
}

TEST(StructuredLogTest, ReachesJournaldAsFields) {
    const FakeJournal journal;
    std::vector<std::string> otherwise;
    const LogSink log =
        journal_sink(journal.path(), LogLevel::info, [&](const LogLine& line) { otherwise.push_back(line.message); });
    log(frame_taken);
    EXPECT_THAT(journal.next(), ElementsAre(Pair("DARKBOX_FRAME", "0003_lamp-02"), Pair("DARKBOX_LAMP", "lamp-02"),
                                            Pair("DARKBOX_SESSION", "vase-1"), Pair("MESSAGE", "frame taken"),
                                            Pair("PRIORITY", "6"), Pair("SYSLOG_IDENTIFIER", "darkboxd")));
    log({LogLevel::error, "two\nlines", {{"token-file", "a=b"}}});
    EXPECT_THAT(journal.next(), ElementsAre(Pair("DARKBOX_TOKEN_FILE", "a=b"), Pair("MESSAGE", "two\nlines"),
                                            Pair("PRIORITY", "3"), Pair("SYSLOG_IDENTIFIER", "darkboxd")));
    log({LogLevel::debug, "too much"});
    EXPECT_THAT(journal.next(), IsEmpty());
    EXPECT_THAT(otherwise, IsEmpty());
}

TEST(StructuredLogTest, GoesElsewhereWhereNoJournaldTakesIt) {
    std::vector<std::string> otherwise;
    const auto note = [&](const LogLine& line) { otherwise.push_back(line.message); };
    journal_sink("/nowhere/at/all", LogLevel::info, note)(frame_taken);
    journal_sink(std::string(200, 'x'), LogLevel::info, note)(frame_taken);
    const FakeJournal journal;
    const std::string huge(1 << 24, 'x');  // more than a datagram holds
    journal_sink(journal.path(), LogLevel::info, note)({LogLevel::info, huge, {}});
    EXPECT_THAT(otherwise, ElementsAre("frame taken", "frame taken", huge));
}

TEST(StructuredLogTest, TellsTheDaemonsEvents) {
    const auto line = [](const std::string& event, const nlohmann::json& fields) {
        return key_value_line(log_line_of(event, fields));
    };
    EXPECT_EQ(line("state", {{"state", "Idle"}, {"problem", ""}}), "level=info msg=\"the rig is Idle\" state=Idle");
    EXPECT_EQ(line("state", {{"state", "Offline"}, {"problem", "no camera"}}),
              "level=warning msg=\"the rig is Offline\" state=Offline problem=\"no camera\"");
    EXPECT_EQ(line("lamps", {{"dark", false}, {"detail", "stuck"}}),
              "level=error msg=\"the lamps could not be proven dark\" detail=stuck");
    EXPECT_EQ(line("done", {{"job", 3}, {"kind", "capture"}, {"session", "vase"}, {"frames", 14}}),
              "level=info msg=\"capture done\" job=3 kind=capture session=vase frames=14");
    EXPECT_EQ(
        line("failed", {{"job", 3}, {"kind", "process"}, {"session", "vase"}, {"detail", "no ball"}, {"hint", "h"}}),
        "level=error msg=\"process failed\" job=3 kind=process session=vase detail=\"no ball\" hint=h");
    EXPECT_EQ(line("progress", {{"job", 3}, {"stage", "capture"}, {"done", 1}, {"total", 9}, {"detail", ""}}),
              "level=debug msg=progress job=3 stage=capture done=1 total=9");
}

TEST(StructuredLogTest, KnowsItsLevels) {
    for (const LogLevel level : {LogLevel::error, LogLevel::warning, LogLevel::notice, LogLevel::info, LogLevel::debug})
        EXPECT_EQ(log_level_from_name(std::string(name(level))), level);
    EXPECT_THAT(input_error_of([] { (void)log_level_from_name("loud"); }), HasSubstr("loud"));
}

}  // namespace
}  // namespace darkbox
