#include "rig/daemon/catalog.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "acquisition/frame/error.h"
#include "acquisition/session/session_writer.h"
#include "processing/formats/calibration_file.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class CatalogTest : public testing::Test {
protected:
    SessionWriter begin(const std::string& name, const std::string& created) const {
        SessionInfo info;
        info.object = "a " + name;
        info.created = created;
        info.source = "import";
        info.planned_shots = 1;
        return SessionWriter::create(folder_.path() / name, info);
    }
    void seal(const std::string& name, const std::string& created = "2026-01-01T00:00:00.000Z") const {
        SessionWriter writer = begin(name, created);
        FrameRecord record;
        record.file = "frames/one.png";
        record.format = "png";
        record.width = record.height = 1;
        record.lamp_name = "one.png";
        writer.add(std::as_bytes(std::span("x", 1)), record);
        writer.seal();
    }
    /// Lamp number `moved` stands `degrees` from where it belongs.
    void calibrate(const std::string& name, double degrees = 0) const {
        Calibration calibration;
        for (int i = 0; i < 8; ++i) {
            const double turn = i * 0.785 + (i == 3 ? degrees * 0.01745 * 2 : 0);
            Light light{.file = "lamp-" + std::to_string(i)};
            light.direction = Eigen::Vector3d(std::cos(turn) * 0.5, std::sin(turn) * 0.5, std::sqrt(0.75));
            light.covariance = 3e-8 * (Eigen::Matrix3d::Identity() - light.direction * light.direction.transpose());
            calibration.lights.push_back(light);
        }
        calibration.condition_number = 2;
        RigIdentity rig{.name = "the rig", .lamps = {}};
        for (const Light& light : calibration.lights) rig.lamps.push_back(light.file);
        fs::create_directories(folder_.path() / name / "calibration");
        write_calibration(folder_.path() / name / "calibration" / "lights.json", calibration, rig);
    }
    static std::vector<std::string> names(const std::vector<SessionListing>& sessions) {
        std::vector<std::string> names;
        for (const auto& session : sessions) names.push_back(session.name);
        return names;
    }

    TemporaryFolder folder_;
};

TEST_F(CatalogTest, FindsWords) {
    for (const char* name : {"cup", "vase"}) {
        SessionInfo info;
        info.object = std::string("a ") + name;
        info.created = "2026-01-01T00:00:00.000Z";
        info.source = "import";
        info.record.inventory = std::string("1907.") + name;
        info.record.dublin_core["creator"] = {"A Potter", "100% _B_"};
        SessionWriter::create(folder_.path() / name, info).seal();
    }
    Catalog catalog(folder_.path());
    catalog.refresh();
    const auto found = [&](const std::string& words) { return names(catalog.sessions({}, words)); };
    EXPECT_THAT(found(""), ElementsAre("cup", "vase"));
    EXPECT_THAT(found("potter"), ElementsAre("cup", "vase"));
    EXPECT_THAT(found("POTTER  1907.Vase"), ElementsAre("vase"));
    EXPECT_THAT(found("potter bowl"), IsEmpty());
    EXPECT_THAT(found("100% _b_"), ElementsAre("cup", "vase"));  // nothing stands for anything else
    EXPECT_THAT(found("1_07"), IsEmpty());
    EXPECT_THAT(found("' OR 1=1 --"), IsEmpty());
    EXPECT_EQ(catalog.session_count("vase"), 1U);
    EXPECT_THAT(names(catalog.sessions({.after = "cup", .limit = 1}, "potter")), ElementsAre("vase"));
    const auto vase = catalog.session("vase");
    ASSERT_TRUE(vase);
    EXPECT_EQ(vase->record.inventory, "1907.vase");
    EXPECT_EQ(vase->record.dublin_core.at("creator"), (std::vector<std::string>{"A Potter", "100% _B_"}));
}

TEST_F(CatalogTest, KnowsWhatLiesOnDisk) {
    seal("cup");
    {
        const SessionWriter left = begin("vase", "2026-02-02T00:00:00.000Z");
    }
    fs::create_directory(folder_.path() / "torn");
    std::ofstream(folder_.path() / "torn" / "journal.jsonl") << "nonsense\n";
    fs::create_directory(folder_.path() / "no-session");
    fs::create_directory_symlink(folder_.path() / "cup", folder_.path() / "linked");
    Catalog catalog(folder_.path());
    EXPECT_THAT(catalog.sessions({}), IsEmpty());
    catalog.refresh();
    const auto sessions = catalog.sessions({});
    ASSERT_THAT(names(sessions), ElementsAre("cup", "torn", "vase"));
    EXPECT_EQ(sessions[0].state, SessionListing::State::sealed);
    EXPECT_EQ(sessions[0].object, "a cup");
    EXPECT_EQ(sessions[0].frames, 1u);
    EXPECT_EQ(sessions[1].state, SessionListing::State::damaged);
    EXPECT_FALSE(sessions[1].problem.empty());
    EXPECT_EQ(sessions[2].state, SessionListing::State::interrupted);
    const auto frames = catalog.frames("cup");
    ASSERT_THAT(frames, SizeIs(1));
    EXPECT_EQ(frames[0].file, "frames/one.png");
    EXPECT_THAT(frames[0].sha256, SizeIs(64));
}

TEST_F(CatalogTest, FollowsWhatChanges) {
    seal("cup");
    Catalog catalog(folder_.path());
    catalog.refresh_if_changed();
    EXPECT_EQ(catalog.session_count(), 1u);
    seal("vase");
    catalog.refresh_if_changed();
    EXPECT_THAT(names(catalog.sessions({})), ElementsAre("cup", "vase"));
    fs::remove_all(folder_.path() / "cup");
    catalog.refresh_if_changed();
    EXPECT_THAT(names(catalog.sessions({})), ElementsAre("vase"));
    EXPECT_THAT(catalog.frames("cup"), IsEmpty());
    // A session that changed inside the folder is seen by a whole refresh, or when it is named.
    fs::remove(folder_.path() / "vase" / "data" / "session.json");
    catalog.refresh("vase");
    EXPECT_EQ(catalog.session("vase")->state, SessionListing::State::damaged);
    EXPECT_THROW(catalog.refresh("../vase"), InputError);
}

TEST_F(CatalogTest, ListsPageByPage) {
    for (const char* name : {"a", "b", "c", "d", "e"}) seal(name);
    Catalog catalog(folder_.path(), Catalog::Place::in_memory);
    catalog.refresh();
    EXPECT_FALSE(fs::exists(catalog.own_folder()));
    EXPECT_THAT(names(catalog.sessions({.limit = 2})), ElementsAre("a", "b"));
    EXPECT_THAT(names(catalog.sessions({.after = "b", .limit = 2})), ElementsAre("c", "d"));
    EXPECT_THAT(names(catalog.sessions({.after = "d", .limit = 2})), ElementsAre("e"));
}

TEST_F(CatalogTest, ComparesEveryCalibrationWithTheLastAndTheFirst) {
    const double moved[] = {0.0, 0.0, 3.0, 3.0};
    for (int i = 0; i < 4; ++i) {
        const std::string name = "run-" + std::to_string(i);
        seal(name, "2026-0" + std::to_string(i + 1) + "-01T00:00:00.000Z");
        calibrate(name, moved[i]);
    }
    Catalog catalog(folder_.path());
    catalog.refresh();
    const auto all = catalog.calibrations({});
    ASSERT_THAT(all, SizeIs(4));
    EXPECT_EQ(all[0].rig, "the rig");
    EXPECT_EQ(all[0].used, 8u);
    EXPECT_THAT(catalog.calibrations({.after = "run-1", .limit = 1}), SizeIs(1));
    EXPECT_EQ(catalog.calibrations({.after = "run-1", .limit = 1})[0].session, "run-2");

    EXPECT_THAT(catalog.drifts("run-0"), IsEmpty());
    const auto check = [&](const std::string& session, const std::string& role, const std::string& against,
                           bool steady) {
        for (const CatalogDrift& drift : catalog.drifts(session)) {
            if (drift.role != role) continue;
            EXPECT_EQ(drift.against, against) << session;
            EXPECT_EQ(drift.steady, steady) << session << " " << drift.findings_json;
            EXPECT_EQ(drift.alarm.empty(), steady) << drift.alarm;
            if (!steady) {
                EXPECT_THAT(drift.alarm, HasSubstr("lamp-3 moved by"));
            }
            return;
        }
        ADD_FAILURE() << session << " was not compared with the " << role;
    };
    check("run-1", "last", "run-0", true);
    check("run-1", "first", "run-0", true);
    check("run-2", "last", "run-1", false);
    check("run-2", "first", "run-0", false);
    check("run-3", "last", "run-2", true);
    check("run-3", "first", "run-0", false);

    // Another history, other comparisons.
    fs::remove_all(folder_.path() / "run-0");
    calibrate("run-1", 3.0);
    catalog.refresh();
    check("run-2", "last", "run-1", true);
    check("run-3", "first", "run-1", true);
    EXPECT_THAT(catalog.drifts("run-1"), IsEmpty());
}

TEST_F(CatalogTest, IsTheSameOnceRebuilt) {
    seal("cup");
    seal("vase");
    calibrate("cup");
    calibrate("vase");
    Catalog catalog(folder_.path());
    catalog.refresh();
    catalog.rebuild();
    EXPECT_THAT(names(catalog.sessions({})), ElementsAre("cup", "vase"));
    EXPECT_THAT(catalog.frames("vase"), SizeIs(1));
    EXPECT_THAT(catalog.calibrations({}), SizeIs(2));
    EXPECT_THAT(catalog.drifts("vase"), SizeIs(2));
}

TEST_F(CatalogTest, IsMadeAnewWhereItIsDamaged) {
    seal("cup");
    {
        Catalog(folder_.path()).refresh();
    }
    const fs::path file = folder_.path() / ".darkbox" / "catalog.sqlite";
    for (const std::string& damage : {std::string(100, 'x'), std::string(200'000, '\xa5')}) {
        std::ofstream(file, std::ios::in | std::ios::out) << damage;
        Catalog catalog(folder_.path());
        EXPECT_TRUE(catalog.was_damaged());
        catalog.refresh();
        EXPECT_EQ(catalog.session_count(), 1u);
        EXPECT_TRUE(fs::exists(file.string() + ".damaged"));
    }
}

TEST_F(CatalogTest, RefusesOneOfANewerDarkbox) {
    {
        const Catalog made(folder_.path());
    }
    const std::string file = folder_.path() / ".darkbox" / "catalog.sqlite";
    SQLite::Database(file, SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
    EXPECT_THROW(Catalog(folder_.path()), InputError);
}

TEST_F(CatalogTest, SurvivesBeingKilledWhileItWrites) {
    for (int i = 0; i < 12; ++i) seal("session-" + std::to_string(i));
    for (int round = 0; round < 10; ++round) {
        const pid_t child = ::fork();
        if (child == 0) {
            Catalog catalog(folder_.path());
            while (true) catalog.rebuild();
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5 + 7 * round));
        ::kill(child, SIGKILL);
        ::waitpid(child, nullptr, 0);
        Catalog catalog(folder_.path());
        EXPECT_FALSE(catalog.was_damaged());
        catalog.refresh();
        EXPECT_EQ(catalog.session_count(), 12u);
        for (const SessionListing& session : catalog.sessions({})) EXPECT_THAT(catalog.frames(session.name), SizeIs(1));
    }
}

}  // namespace
}  // namespace darkbox
