#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/rig/cli/program.h"
#include "tests/support/child_process.h"
#include "tests/support/test_data.h"

namespace darkbox::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class CapturesCommandTest : public testing::Test {
protected:
    std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
    ProgramResult capture(std::vector<std::string> more) const {
        std::vector<std::string> arguments{"capture", "--standalone", "--simulate", "5", "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return darkbox_program(arguments);
    }
    std::string script(const std::string& text) const {
        std::ofstream(at("hook.sh")) << "#!/bin/sh\n" << text << "\n";
        fs::permissions(at("hook.sh"), fs::perms::owner_all);
        return at("hook.sh");
    }
    static json exiftool(const std::string& picture, const std::string& log) {
        ChildProcess program({"/usr/bin/exiftool", "-json", "-G1", picture}, log);
        EXPECT_EQ(program.wait(), 0) << program.err();
        return json::parse(program.out()).at(0);
    }
    TemporaryFolder folder_;
};

TEST_F(CapturesCommandTest, WhatIsKnownOfAnObjectReachesItsPictures) {
    const auto captured = capture({"--out", at("vase"), "--object", "vase", "--inventory", "1907.12 a", "--meta",
                                   "title=A vase", "--meta", "creator=A", "--meta", "creator=B"});
    ASSERT_EQ(captured.status, 0) << captured.err;
    const auto found = darkbox_program({"sessions", "--folder", at(""), "--find", "VASE 1907", "--json"});
    EXPECT_EQ(json::parse(found.out).at("sessions").at(0).at("dublin_core").at("creator"), json({"A", "B"}));
    EXPECT_EQ(json::parse(darkbox_program({"sessions", "--folder", at(""), "--find", "cup", "--json"}).out)
                  .at("sessions")
                  .size(),
              0U);
    const auto processed = darkbox_program({"process", at("vase"), "--solver", "robust", "--json"});
    ASSERT_EQ(processed.status, 0) << processed.err;
    const auto relit =
        darkbox_program({"relight", at("vase"), "--light", "0,0,1", "--model", "phong", "--out", at("r.jpg")});
    ASSERT_EQ(relit.status, 0) << relit.err;
    if (!fs::exists("/usr/bin/exiftool")) GTEST_SKIP() << "exiftool is not installed";
    for (const std::string picture :
         {"vase/results/normals.png", "vase/results/relit-left.png", "vase/texels/index.png", "r.jpg"}) {
        const json read = exiftool(at(picture), at("log"));
        EXPECT_EQ(read.at("XMP-dc:Title"), "A vase") << picture;
        EXPECT_EQ(read.at("XMP-dc:Creator"), json({"A", "B"}));
        EXPECT_EQ(read.at("XMP-dc:Identifier"), "1907.12 a");
        EXPECT_EQ(read.at("XMP-darkbox:Session"), "vase");
        EXPECT_EQ(read.at("XMP-darkbox:Solver"), "robust");
        EXPECT_THAT(read.at("XMP-darkbox:Parameters").get<std::string>(), HasSubstr("normals.solver=robust"));
        EXPECT_EQ(read.at("XMP-darkbox:SessionManifestSha256").get<std::string>().size(), 64U);
    }
    EXPECT_THAT(exiftool(at("r.jpg"), at("log")).at("XMP-darkbox:Parameters").get<std::string>(),
                AllOf(HasSubstr("relight.model=phong"), HasSubstr("relight.light=0,0,1")));
}

TEST_F(CapturesCommandTest, ASeriesRunsItsHookBetween) {
    const std::string hook = script("echo \"$1 $(basename $DARKBOX_SESSION) $DARKBOX_CAPTURED\" >>" + at("log"));
    const auto series = capture({"--out", at("turn"), "--repeat", "3", "--between", hook + " '15 deg'"});
    ASSERT_EQ(series.status, 0) << series.err;
    EXPECT_EQ(json::parse(series.out).at("captures").size(), 3U);
    for (const char* name : {"turn-001", "turn-002", "turn-003"})
        EXPECT_TRUE(fs::exists(at(name) + "/tagmanifest-sha256.txt")) << name;
    std::ifstream log(at("log"));
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(log), {}), "15 deg turn-001 1\n15 deg turn-002 2\n");
}

TEST_F(CapturesCommandTest, AHookThatFailsEndsTheSeries) {
    const auto series = capture({"--out", at("turn"), "--repeat", "3", "--between", script("exit 3")});
    EXPECT_EQ(series.status, 1);
    EXPECT_THAT(series.err, AllOf(HasSubstr("after capture 1 of 3"), HasSubstr("failed with status 3")));
    EXPECT_TRUE(fs::exists(at("turn-001") + "/tagmanifest-sha256.txt"));
    EXPECT_FALSE(fs::exists(at("turn-002")));
}

TEST_F(CapturesCommandTest, RefusesWhatMakesNoSense) {
    EXPECT_THAT(capture({"--out", at("a"), "--meta", "titel=x"}).err, HasSubstr("titel"));
    EXPECT_THAT(capture({"--out", at("a"), "--between", "true"}).err, HasSubstr("--repeat"));
    EXPECT_THAT(capture({"--out", at("a"), "--repeat", "2", "--between", "'"}).err, HasSubstr("quote"));
    EXPECT_FALSE(fs::exists(at("a")));
    EXPECT_FALSE(fs::exists(at("a-001")));
}

TEST_F(CapturesCommandTest, PruningSaysWhatItWouldDo) {
    ASSERT_EQ(capture({"--out", at("new")}).status, 0);
    const auto said = darkbox_program({"sessions", "prune", "--folder", at(""), "--keep-days", "1", "--json"});
    ASSERT_EQ(said.status, 0) << said.err;
    EXPECT_EQ(json::parse(said.out).at("kept"), json({{"younger than 1 days", 1}}));
    EXPECT_TRUE(fs::exists(at("new")));
    EXPECT_EQ(darkbox_program({"sessions", "prune", "--folder", at("")}).status, 1);
}

}  // namespace
}  // namespace darkbox::test
