#include "acquisition/session/object_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "acquisition/session/bag.h"
#include "tests/acquisition/session/session_fixture.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

ObjectRecord vase() {
    ObjectRecord record{.inventory = "1907.12 a", .dublin_core = {}};
    add_value("test", record, "title", "A vase");
    add_value("test", record, "creator", "Potter, A.");
    add_value("test", record, "creator", "Jørgen Ångström: painter");
    add_value("test", record, "description", "Red figures.\n  Two handles,\n\none mended");
    return record;
}

/// bag-info.txt as RFC 8493, section 2.2.2, has it: a line that begins with white space goes on with the value above.
std::vector<std::pair<std::string, std::string>> read_tags(const std::string& text) {
    std::vector<std::pair<std::string, std::string>> tags;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(' ') || line.starts_with('\t')) {
            tags.back().second += "\n" + line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
        } else {
            const auto colon = line.find(':');
            tags.emplace_back(line.substr(0, colon), line.substr(std::min(colon + 2, line.size())));
        }
    }
    return tags;
}

class ObjectRecordTest : public testing::Test {
protected:
    Session seal(const ObjectRecord& record) {
        SessionInfo info = capture_info(0);
        info.record = record;
        return SessionWriter::create(folder_.path() / "s", info).seal();
    }
    TemporaryFolder folder_;
};

TEST_F(ObjectRecordTest, IsKeptWithTheSession) {
    const Session session = seal(vase());
    EXPECT_EQ(session.info().record, vase());
    session.verify();
}

TEST_F(ObjectRecordTest, IsKeptThroughAnInterruption) {
    SessionInfo info = capture_info(0);
    info.record = vase();
    {
        const SessionWriter left = SessionWriter::create(folder_.path() / "s", info);
    }
    EXPECT_EQ(SessionWriter::resume(folder_.path() / "s").seal().info().record, vase());
}

TEST_F(ObjectRecordTest, IsWrittenIntoBagInfo) {
    const auto tags = read_tags(read_file(seal(vase()).folder() / "bag-info.txt"));
    const auto values = [&](const std::string& label) {
        std::vector<std::string> found;
        for (const auto& [name, value] : tags)
            if (name == label) found.push_back(value);
        return found;
    };
    EXPECT_THAT(values("External-Identifier"), ElementsAre("1907.12 a"));
    EXPECT_THAT(values("Inventory-Number"), ElementsAre("1907.12 a"));
    EXPECT_THAT(values("Object"), ElementsAre("a brick"));
    EXPECT_THAT(values("DC-Title"), ElementsAre("A vase"));
    EXPECT_THAT(values("DC-Creator"), ElementsAre("Potter, A.", "Jørgen Ångström: painter"));
    // The blanks before "Two handles" are padding by the standard.
    EXPECT_THAT(values("DC-Description"), ElementsAre("Red figures.\nTwo handles,\n\none mended"));
}

TEST_F(ObjectRecordTest, CannotForgeATag) {
    ObjectRecord record;
    add_value("test", record, "title", "A vase\nPayload-Oxum: 0.0");
    const auto tags = read_tags(read_file(seal(record).folder() / "bag-info.txt"));
    EXPECT_EQ(std::ranges::count(tags, "Payload-Oxum", [](const auto& tag) { return tag.first; }), 1);
    EXPECT_THAT(tags, testing::Contains(Pair("DC-Title", "A vase\nPayload-Oxum: 0.0")));
}

TEST_F(ObjectRecordTest, IsAbsentWhereNothingIsKnown) {
    const Session session = seal({});
    EXPECT_TRUE(session.info().record.empty());
    EXPECT_THAT(read_file(session.folder() / "data/session.json"), testing::Not(HasSubstr("dublin_core")));
}

TEST(ObjectRecordErrorsTest, NameWhatIsWrong) {
    ObjectRecord record;
    EXPECT_THAT(input_error_of([&] { add_assignment("--meta", record, "titel=A vase"); }),
                AllOf(HasSubstr("--meta"), HasSubstr("titel")));
    EXPECT_THAT(input_error_of([&] { add_assignment("--meta", record, "title"); }), HasSubstr("KEY=VALUE"));
    EXPECT_THAT(input_error_of([&] { add_assignment("--meta", record, "title= \n"); }), HasSubstr("title is empty"));
    EXPECT_THAT(input_error_of([&] { add_assignment("--meta", record, "title=a\rb"); }), HasSubstr("control"));
    EXPECT_THAT(input_error_of([&] { add_assignment("--meta", record, "title=\xff"); }), HasSubstr("UTF-8"));
    EXPECT_THAT(input_error_of([&] { add_value("x", record, "title", std::string(4001, 'a')); }), HasSubstr("4000"));
    EXPECT_TRUE(record.empty());
    add_assignment("--meta", record, "rights=a=b");
    EXPECT_EQ(record.dublin_core.at("rights"), std::vector<std::string>{"a=b"});
    record.inventory = "1\n2";
    EXPECT_THAT(input_error_of([&] { require_valid("x", record); }), HasSubstr("inventory"));
    record = {};
    for (int i = 0; i < 101; ++i) add_value("x", record, "subject", "s");
    EXPECT_THAT(input_error_of([&] { require_valid("x", record); }), HasSubstr("101 values"));
}

}  // namespace
}  // namespace darkbox
