#include "rig/daemon/api.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "tests/rig/daemon/fake_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using namespace test;

class ApiTest : public testing::Test {
protected:
    ApiTest()
        : service_(open_fake(script_), ServiceOptions{.sessions = folder_.path()}, log_),
          api_(rig_, service_, metrics_) {
        EXPECT_TRUE(reaches(service_, ServiceState::idle));
    }
    ApiResponse get(const std::string& target) { return api_.answer({.method = "GET", .target = "/api/v1/" + target}); }
    ApiResponse post(const std::string& target, const std::string& body) {
        return api_.answer({.method = "POST",
                            .target = "/api/v1/" + target,
                            .content_type = "application/json; charset=utf-8",
                            .body = body});
    }

    TemporaryFolder folder_;
    FakeRigScript script_;
    EventLog log_;
    RigDescription rig_ = parse_rig(simulated_rig_toml(4), "rig.toml");
    Metrics metrics_;
    Service service_;
    Api api_;
};

TEST_F(ApiTest, TellsTheStatus) {
    const ApiResponse response = get("status");
    EXPECT_EQ(response.status, 200);
    const json status = json::parse(response.body);
    EXPECT_EQ(status.at("state"), "Idle");
    EXPECT_EQ(status.at("rig"), "simulated-4");
    EXPECT_EQ(status.at("lamps").at("count"), 4);
    EXPECT_FALSE(status.contains("running"));
}

TEST_F(ApiTest, RunsACaptureToItsEnd) {
    Gate gate;
    script_.body = [&](const auto&, const auto&) { gate.wait(); };
    const ApiResponse accepted = post("captures", R"({"object":"vase","lamps":["lamp-01"],"name":"first"})");
    EXPECT_EQ(accepted.status, 202);
    const json job = json::parse(accepted.body);
    EXPECT_EQ(job.at("session"), "first");
    const std::string target = "jobs/" + std::to_string(job.at("id").get<int>());
    EXPECT_EQ(json::parse(get(target).body).at("state"), "running");
    EXPECT_EQ(json::parse(get("status").body).at("running").at("session"), "first");

    const ApiResponse refused = post("captures", R"({"object":"vase"})");
    EXPECT_EQ(refused.status, 409);
    EXPECT_THAT(refused.body, HasSubstr("Busy"));

    gate.open();
    ASSERT_TRUE(reaches(service_, ServiceState::idle));
    const json done = json::parse(get(target).body);
    EXPECT_EQ(done.at("state"), "done");
    EXPECT_EQ(done.at("frames"), 5);
    EXPECT_EQ(done.at("resumed"), 1);
    EXPECT_EQ(done.at("repeated"), 2);
    EXPECT_EQ(done.at("most_queued_bytes"), 7);
}

TEST_F(ApiTest, CancelsACapture) {
    script_.body = run_until_cancelled;
    const json job = json::parse(post("captures", R"({"object":"vase"})").body);
    const std::string target = "/api/v1/jobs/" + std::to_string(job.at("id").get<int>());
    EXPECT_EQ(api_.answer({.method = "DELETE", .target = target}).status, 202);
    ASSERT_TRUE(reaches(service_, ServiceState::idle));
    EXPECT_EQ(json::parse(get("jobs/1").body).at("state"), "cancelled");
}

TEST_F(ApiTest, DarkensTheLamps) {
    const ApiResponse response = post("lamps/dark", "");
    EXPECT_EQ(response.status, 202);
    const auto event = json::parse(response.body).at("event").get<std::uint64_t>();
    ASSERT_TRUE(eventually([&] { return !log_.after(event).empty(); }));
    const json told = json::parse(log_.after(event).front().json);
    EXPECT_EQ(told.at("event"), "lamps");
    EXPECT_EQ(told.at("dark"), true);
}

TEST_F(ApiTest, ListsLamps) {
    const json lamps = json::parse(get("lamps").body).at("lamps");
    ASSERT_EQ(lamps.size(), 4u);
    EXPECT_EQ(lamps[3].at("name"), "lamp-04");
    EXPECT_EQ(lamps[3].at("position_mm").size(), 3u);
}

TEST_F(ApiTest, ListsSessionsAndTellsDamagedOnesApart) {
    const auto make = [this](const std::string& name, const std::string& file) {
        std::filesystem::create_directories(folder_.path() / name);
        std::ofstream(folder_.path() / name / file) << "nonsense\n";
    };
    make("torn", "journal.jsonl");
    make("not-a-session", "readme.txt");
    make(".hidden", "journal.jsonl");
    const json sessions = json::parse(get("sessions").body).at("sessions");
    ASSERT_EQ(sessions.size(), 1u);
    EXPECT_EQ(sessions[0].at("name"), "torn");
    EXPECT_EQ(sessions[0].at("state"), "damaged");
    EXPECT_FALSE(sessions[0].at("problem").get<std::string>().empty());
}

TEST_F(ApiTest, StreamsEventsAfterANumber) {
    EXPECT_EQ(get("events").stream_events, 0u);
    EXPECT_EQ(get("events?after=17").stream_events, 17u);
    EXPECT_EQ(get("events").content_type, "application/x-ndjson");
}

struct BadRequest {
    const char* method;
    const char* target;
    const char* body;
    int status;
    const char* told;
};

class BadRequests : public ApiTest, public testing::WithParamInterface<BadRequest> {};

TEST_P(BadRequests, AreAnsweredWithAProblem) {
    const BadRequest& bad = GetParam();
    const ApiResponse response =
        api_.answer({.method = bad.method, .target = bad.target, .content_type = "application/json", .body = bad.body});
    EXPECT_EQ(response.status, bad.status);
    EXPECT_EQ(response.content_type, "application/problem+json");
    EXPECT_FALSE(response.stream_events);
    const json problem = json::parse(response.body);
    EXPECT_EQ(problem.at("status"), bad.status);
    EXPECT_FALSE(problem.at("title").get<std::string>().empty());
    EXPECT_EQ(problem.at("type"), "about:blank");
    EXPECT_THAT(problem.at("detail").get<std::string>(), HasSubstr(bad.told));
    EXPECT_FALSE(problem.at("hint").get<std::string>().empty());
    EXPECT_EQ(script_.captures, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Api, BadRequests,
    testing::Values(BadRequest{"GET", "/", "", 404, "address"}, BadRequest{"GET", "", "", 404, "address"},
                    BadRequest{"GET", "/api/v2/status", "", 404, "address"},
                    BadRequest{"GET", "/api/v1/../v1/status", "", 404, "address"},
                    BadRequest{"GET", "/api/v1/status/", "", 404, "address"},
                    BadRequest{"GET", "/api/v1/status?x=1", "", 400, "query"},
                    BadRequest{"POST", "/api/v1/status", "", 405, "POST"},
                    BadRequest{"BREW", "/api/v1/lamps/dark", "", 405, "BREW"},
                    BadRequest{"GET", "/api/v1/captures", "", 405, "GET"},
                    BadRequest{"GET", "/api/v1/jobs/", "", 400, "number"},
                    BadRequest{"GET", "/api/v1/jobs/-1", "", 400, "number"},
                    BadRequest{"GET", "/api/v1/jobs/1x", "", 400, "number"},
                    BadRequest{"GET", "/api/v1/jobs/99999999999999999999999", "", 400, "number"},
                    BadRequest{"GET", "/api/v1/jobs/7", "", 404, "no job 7"},
                    BadRequest{"DELETE", "/api/v1/jobs/7", "", 404, "no job 7"},
                    BadRequest{"GET", "/api/v1/events?after=-1", "", 400, "number"},
                    BadRequest{"GET", "/api/v1/events?before=1", "", 400, "query"},
                    BadRequest{"POST", "/api/v1/captures", "", 400, "not JSON"},
                    BadRequest{"POST", "/api/v1/captures", "{", 400, "not JSON"},
                    BadRequest{"POST", "/api/v1/captures", "{\"object\":\"\xff\"}", 400, "not JSON"},
                    BadRequest{"POST", "/api/v1/captures", "[]", 400, "not a JSON object"},
                    BadRequest{"POST", "/api/v1/captures", "null", 400, "not a JSON object"},
                    BadRequest{"POST", "/api/v1/captures", R"({"objekt":"x"})", 400, "objekt"},
                    BadRequest{"POST", "/api/v1/captures", R"({"object":7})", 400, "not a string"},
                    BadRequest{"POST", "/api/v1/captures", R"({"object":"a\u0000b"})", 400, "control character"},
                    BadRequest{"POST", "/api/v1/captures", R"({"lamps":"lamp-01"})", 400, "not a list"},
                    BadRequest{"POST", "/api/v1/captures", R"({"lamps":[1]})", 400, "not a string"},
                    BadRequest{"POST", "/api/v1/captures", R"({"name":"../../etc"})", 400, "not the name"},
                    BadRequest{"POST", "/api/v1/captures", R"({"name":".ssh"})", 400, "not the name"},
                    BadRequest{"POST", "/api/v1/captures", R"({"name":"/tmp/x"})", 400, "not the name"},
                    BadRequest{"POST", "/api/v1/captures", R"({"resume":"a/b"})", 400, "not the name"},
                    BadRequest{"POST", "/api/v1/captures", R"({"resume":"absent"})", 404, "absent"},
                    BadRequest{"POST", "/api/v1/captures", R"({"resume":"a","object":"b"})", 400, "resumed"}));

TEST_F(ApiTest, SurvivesDeepAndLongBodies) {
    EXPECT_EQ(post("captures", std::string(65536, '[')).status, 400);
    EXPECT_EQ(post("captures", std::string(30000, '[') + std::string(30000, ']')).status, 400);
    EXPECT_EQ(post("captures", R"({"object":")" + std::string(60000, 'x') + "\"}").status, 400);
}

TEST_F(ApiTest, WantsJsonToBeCalledSo) {
    const ApiResponse response =
        api_.answer({.method = "POST", .target = "/api/v1/captures", .content_type = "text/plain", .body = "{}"});
    EXPECT_EQ(response.status, 415);
}

TEST_F(ApiTest, NamesTheMethodsThatWouldDo) {
    EXPECT_EQ(api_.answer({.method = "PUT", .target = "/api/v1/jobs/1"}).allow, "GET, DELETE");
}

}  // namespace
}  // namespace darkbox
