#include "rig/daemon/retention.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "acquisition/frame/error.h"
#include "acquisition/session/session_writer.h"
#include "acquisition/session/sha256.h"
#include "processing/formats/calibration_file.h"
#include "rig/daemon/session_folder.h"
#include "tests/support/test_data.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

/// The disk of the tests: 10 GB, of which the sessions' files are taken.
std::uint64_t ten_gigabytes(const fs::path& folder) {
    std::uint64_t used = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && entry.path().extension() == ".png") used += 1'000'000'000;
    return 10'000'000'000 - used;
}

std::string numbered(std::string name, int number) { return name.append(std::to_string(number)); }

class RetentionTest : public testing::Test {
protected:
    /// Made on this day of January 2026.
    void capture(const std::string& name, int day, bool verified = true, const std::string& source = "capture") {
        seal(begin(name, day, source), verified);
    }
    SessionWriter begin(const std::string& name, int day, const std::string& source = "capture") {
        SessionInfo info;
        info.object = "a " + name;
        info.created = "2026-01-" + std::string(day < 10 ? "0" : "") + std::to_string(day) + "T12:00:00.000Z";
        info.source = source;
        info.planned_shots = 1;
        return SessionWriter::create(at(name), info);
    }
    static void seal(SessionWriter writer, bool verified = true) {
        FrameRecord record;
        record.file = "frames/one.png";
        record.format = "png";
        record.width = record.height = 1;
        record.verified = verified;
        writer.add(std::as_bytes(std::span("x", 1)), record);
        writer.seal();
    }
    void calibrate(const std::string& name) const {
        Calibration calibration;
        calibration.lights.push_back({.file = "lamp-1"});
        calibration.lights.back().direction = {0, 0, 1};
        calibration.condition_number = 1;
        fs::create_directories(at(name) / "calibration");
        write_calibration(at(name) / "calibration" / "lights.json", calibration,
                          {.name = "the rig", .lamps = {"lamp-1"}});
    }
    /// A member of what the session says of itself, as re-takes have one, with the seal made good again.
    void refer(const std::string& from, const std::string& to) const {
        const fs::path document = at(from) / "data/session.json";
        auto json = nlohmann::json::parse(text_of(document));
        json["session"]["retakes"] = {{"session", to}, {"manifest_sha256", std::string(64, '0')}};
        replace_file(document, json.dump());
        for (const auto& [manifest, file] : {std::pair{"manifest-sha256.txt", "data/session.json"},
                                             std::pair{"tagmanifest-sha256.txt", "manifest-sha256.txt"}}) {
            std::string lines = text_of(at(from) / manifest);
            const auto place = lines.find(std::string("  ") + file);
            lines.replace(place - 64, 64, sha256_of_file(at(from) / file));
            replace_file(at(from) / manifest, lines);
        }
    }
    static std::string text_of(const fs::path& file) {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    static void replace_file(const fs::path& file, const std::string& text) {
        fs::remove(file);
        std::ofstream(file, std::ios::binary) << text;
    }

    /// As on the last day of January.
    PruneReport prune(const RetentionRules& rules, bool dry_run = false, std::set<std::string> keep = {}) const {
        return prune_sessions(folder_.path(), {.rules = rules,
                                               .dry_run = dry_run,
                                               .keep = std::move(keep),
                                               .now = std::chrono::sys_days{std::chrono::year{2026} / 1 / 31},
                                               .free_bytes = ten_gigabytes});
    }
    static std::vector<std::string> removed(const PruneReport& report) {
        std::vector<std::string> names;
        for (const auto& session : report.removed) names.push_back(session.name);
        return names;
    }
    std::vector<std::string> left() const { return session_names(folder_.path()); }
    fs::path at(const std::string& name) const { return folder_.path() / name; }

    TemporaryFolder folder_;
};

TEST_F(RetentionTest, RemovesWhatIsOldOldestFirst) {
    capture("c", 3);
    capture("a", 5);
    capture("b", 29);
    const PruneReport report = prune({.keep_days = 7});
    EXPECT_THAT(removed(report), ElementsAre("c", "a"));
    EXPECT_THAT(report.kept, ElementsAre(Pair("younger than 7 days", 1)));
    EXPECT_GT(report.bytes, 0U);
    EXPECT_THAT(left(), ElementsAre("b"));
    EXPECT_FALSE(fs::exists(folder_.path() / ".darkbox/removed"));
    EXPECT_THAT(removed(prune({.keep_days = 7})), IsEmpty());
}

TEST_F(RetentionTest, ADryRunSaysTheSameAndRemovesNothing) {
    for (int day = 1; day <= 4; ++day) capture(numbered("s", day), day);
    const RetentionRules rules{.keep_days = 7, .keep_newest = 1, .free_gb = 7.5};
    const PruneReport said = prune(rules, true);
    EXPECT_EQ(left().size(), 4U);
    EXPECT_FALSE(fs::exists(folder_.path() / ".darkbox"));
    // What a dry run would have freed are the files' own bytes, few here, so it goes on to what the rules allow.
    EXPECT_THAT(removed(said), ElementsAre("s1", "s2", "s3"));
}

TEST_F(RetentionTest, RemovesNoMoreThanIsNeeded) {
    for (int day = 1; day <= 4; ++day) capture(numbered("s", day), day);
    EXPECT_THAT(removed(prune({.keep_days = 7, .free_gb = 6})), IsEmpty());
    EXPECT_THAT(removed(prune({.keep_days = 7, .free_gb = 7.5})), ElementsAre("s1", "s2"));
    EXPECT_THAT(left(), ElementsAre("s3", "s4"));
}

TEST_F(RetentionTest, KeepsTheNewest) {
    for (int day = 1; day <= 4; ++day) capture(numbered("s", day), day);
    EXPECT_THAT(removed(prune({.keep_days = 7, .keep_newest = 3})), ElementsAre("s1"));
}

TEST_F(RetentionTest, ACorruptedSessionStays) {
    capture("good", 1);
    capture("flipped", 2);
    replace_file(at("flipped") / "data/frames/one.png", "y");
    capture("cut", 3);
    fs::remove(at("cut") / "data/frames/one.png");
    capture("longer", 4);
    std::ofstream(at("longer") / "data/unlisted") << "z";
    const PruneReport report = prune({.keep_days = 7});
    EXPECT_THAT(removed(report), ElementsAre("good"));
    EXPECT_THAT(report.unverified, ElementsAre(AllOf(HasSubstr("flipped: "), HasSubstr("checksum")),
                                               AllOf(HasSubstr("cut: "), HasSubstr("missing")),
                                               AllOf(HasSubstr("longer: "), HasSubstr("not in the manifest"))));
    EXPECT_THAT(left(), ElementsAre("cut", "flipped", "longer"));
}

TEST_F(RetentionTest, WhatIsNotProvenStays) {
    capture("doubtful", 1, false);
    capture("imported", 1, true, "import");
    {
        const SessionWriter interrupted = begin("interrupted", 1);
    }
    capture("damaged", 1);
    replace_file(at("damaged") / "data/session.json", "{");
    const PruneReport report = prune({.keep_days = 7});
    EXPECT_THAT(report.removed, IsEmpty());
    EXPECT_THAT(report.unverified, ElementsAre(AllOf(HasSubstr("doubtful"), HasSubstr("was not verified"))));
    EXPECT_THAT(report.kept, ElementsAre(Pair("damaged", 1), Pair("interrupted", 1), Pair("it was imported", 1)));
    EXPECT_EQ(left().size(), 4U);
}

TEST_F(RetentionTest, WhatAnotherRefersToStays) {
    capture("first", 1);
    capture("again", 30);
    refer("again", "first");
    capture("other", 1);
    EXPECT_THAT(removed(prune({.keep_days = 7})), ElementsAre("other"));
    EXPECT_THAT(left(), ElementsAre("again", "first"));
    fs::remove_all(at("again"));
    EXPECT_THAT(removed(prune({.keep_days = 7})), ElementsAre("first"));
}

TEST_F(RetentionTest, WhatAnInterruptedCaptureTakesFramesOverFromStays) {
    capture("card", 1);
    capture("other", 1);
    SessionInfo info;
    info.created = "2026-01-30T12:00:00.000Z";
    info.source = "capture";
    info.planned_shots = 2;
    info.flats = SessionReference{"card", std::string(64, '0')};
    {
        const SessionWriter interrupted = SessionWriter::create(at("vase"), info);
    }
    EXPECT_THAT(removed(prune({.keep_days = 7})), ElementsAre("other"));
    EXPECT_THAT(left(), ElementsAre("card", "vase"));
}

TEST_F(RetentionTest, FirstAndLastCalibrationOfARigStay) {
    for (int day = 1; day <= 4; ++day) {
        capture(numbered("ball-", day), day);
        calibrate(numbered("ball-", day));
    }
    EXPECT_THAT(removed(prune({.keep_days = 7})), ElementsAre("ball-2", "ball-3"));
}

TEST_F(RetentionTest, WhatAJobWaitsForStays) {
    capture("a", 1);
    capture("b", 1);
    EXPECT_THAT(removed(prune({.keep_days = 7}, false, {"a"})), ElementsAre("b"));
}

TEST_F(RetentionTest, FinishesWhatAnEarlierRunBegan) {
    capture("a", 1);
    fs::create_directories(folder_.path() / ".darkbox/removed/half/data");
    EXPECT_THAT(removed(prune({.keep_days = 60})), IsEmpty());
    EXPECT_FALSE(fs::exists(folder_.path() / ".darkbox/removed"));
    EXPECT_THAT(left(), ElementsAre("a"));
}

TEST_F(RetentionTest, RefusesRulesThatSayNothing) {
    EXPECT_THAT(input_error_of([&] { prune({}); }), HasSubstr("keep_days is 0"));
    EXPECT_THAT(input_error_of([&] { prune({.keep_days = 1, .keep_newest = -1}); }), HasSubstr("keep_newest"));
}

}  // namespace
}  // namespace darkbox
