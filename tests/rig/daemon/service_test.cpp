#include "rig/daemon/service.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <optional>
#include <string>

#include "rig/lamps/door.h"
#include "tests/rig/daemon/fake_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace test;

class ServiceTest : public testing::Test {
protected:
    Service& start() {
        ServiceOptions options;
        options.sessions = folder_.path();
        options.reopen_every = std::chrono::milliseconds(5);
        options.shine = [this](const HandLight& light, const LentDevices& devices, const WorkContext& work) {
            devices.lamps.light(light.lamp, 1.0);
            while_lit_(work);
        };
        service_.emplace(open_fake(script_), options, log_);
        return *service_;
    }
    Service& start_idle() {
        Service& service = start();
        EXPECT_TRUE(reaches(service, ServiceState::idle));
        return service;
    }
    Service& start_busy() {
        script_.body = run_until_cancelled;
        Service& service = start_idle();
        service.start_capture({.object = "vase"});
        EXPECT_TRUE(eventually([this] { return script_.lit.load(); }));
        return service;
    }
    Service& start_hand_light() {
        while_lit_ = [](const WorkContext& work) { EXPECT_TRUE(eventually([&] { return work.cancelled(); })); };
        Service& service = start_idle();
        service.light({LampId{0}, Seconds(1), ""});
        EXPECT_TRUE(eventually([this] { return script_.lit.load(); }));
        return service;
    }
    Service& start_fault() {
        Service& service = start_idle();
        script_.dark_fails = true;
        service.darken();
        EXPECT_TRUE(reaches(service, ServiceState::fault));
        return service;
    }
    Service& start_offline() {
        script_.failing_opens = 1'000'000;
        Service& service = start();
        EXPECT_TRUE(eventually([&] { return !service.status().problem.empty(); }));
        return service;
    }
    static JobState end_of(const Service& service, std::uint64_t id) {
        EXPECT_TRUE(eventually([&] { return service.job(id).state != JobState::running; }));
        return service.job(id).state;
    }
    static std::string refusal(Service& service) {
        try {
            service.start_capture({.object = "vase"});
        } catch (const Refused& refused) {
            EXPECT_FALSE(refused.hint().empty());
            return refused.what();
        }
        return "accepted";
    }

    TemporaryFolder folder_;
    FakeRigScript script_;
    EventLog log_;
    std::function<void(const WorkContext&)> while_lit_ = [](const WorkContext&) {};
    std::optional<Service> service_;
};

TEST_F(ServiceTest, CapturesAndIsIdleAgain) {
    script_.body = [](const CaptureRequest& request, const WorkContext& work) {
        EXPECT_EQ(request.object, "Grandma's vase");
        EXPECT_EQ(request.lamps, std::vector<std::string>{"lamp-02"});
        EXPECT_EQ(request.start, CaptureStart::create);
        work.tell({.stage = "capture", .done = 3, .total = 5, .detail = "lamp-02"});
    };
    Service& service = start_idle();
    const Job job = service.start_capture({.object = "Grandma's vase", .lamps = {"lamp-02"}});
    EXPECT_EQ(job.state, JobState::running);
    EXPECT_THAT(job.session, testing::MatchesRegex("Grandma-s-vase-[0-9]*-[0-9]*"));
    ASSERT_EQ(end_of(service, job.id), JobState::done);

    const Job done = service.job(job.id);
    EXPECT_EQ(done.outcome.session, folder_.path() / job.session);
    EXPECT_EQ(done.outcome.frames, 5u);
    EXPECT_EQ(done.progress.done, 3u);
    EXPECT_EQ(service.status().state, ServiceState::idle);
    EXPECT_FALSE(service.status().running);
    EXPECT_FALSE(script_.lit);
    EXPECT_THAT(event_types(log_), ElementsAre("state", "state", "progress", "lamps", "state", "done"));
    EXPECT_EQ(all_events(log_).back().at("job"), job.id);
}

TEST_F(ServiceTest, RefusesACaptureInEveryStateButIdle) {
    EXPECT_THAT(refusal(start_offline()), HasSubstr("Offline"));
    service_.reset();
    script_.failing_opens = 0;
    EXPECT_THAT(refusal(start_busy()), HasSubstr("Busy"));
    service_.reset();
    EXPECT_THAT(refusal(start_fault()), HasSubstr("Fault"));
    EXPECT_EQ(script_.captures, 1);
}

TEST_F(ServiceTest, RefusesToDarkenWhatIsNotOpen) { EXPECT_THROW(start_offline().darken(), Refused); }

TEST_F(ServiceTest, LightsALampByHandOnlyWhenIdleAndIsBusyMeanwhile) {
    EXPECT_THROW(start_offline().light({LampId{0}, Seconds(1), ""}), Refused);
    service_.reset();
    script_.failing_opens = 0;
    EXPECT_THROW(start_busy().light({LampId{0}, Seconds(1), ""}), Refused);
    service_.reset();
    EXPECT_THROW(start_fault().light({LampId{0}, Seconds(1), ""}), Refused);
    service_.reset();
    script_.dark_fails = false;
    script_.body = [](const auto&, const auto&) {};
    Service& service = start_idle();
    const std::uint64_t before = service.light({LampId{0}, Seconds(1), ""});
    EXPECT_TRUE(eventually([this] { return event_types(log_).back() == "light"; }));
    EXPECT_EQ(service.status().state, ServiceState::idle);
    EXPECT_GT(all_events(log_).back().at("number").get<std::uint64_t>(), before);
    EXPECT_EQ(all_events(log_).back().at("lit"), true);
    EXPECT_EQ(end_of(service, service.start_capture({.object = "vase"}).id), JobState::done);
}

TEST_F(ServiceTest, DarkenEndsALampLitByHand) {
    Service& service = start_hand_light();
    try {
        service.start_capture({.object = "vase"});
        FAIL() << "accepted";
    } catch (const Refused& refused) {
        EXPECT_THAT(refused.hint(), HasSubstr("darkbox lamps dark"));
    }
    service.darken();
    EXPECT_TRUE(reaches(service, ServiceState::idle));
    EXPECT_FALSE(script_.lit);
    EXPECT_THAT(event_types(log_), testing::Contains("light"));
}

TEST_F(ServiceTest, StoppingEndsALampLitByHand) {
    Service& service = start_hand_light();
    service.request_stop();
    EXPECT_TRUE(eventually([this] { return log_.closed(); }));
    EXPECT_FALSE(script_.lit);
    EXPECT_FALSE(script_.open);
    EXPECT_THAT(event_types(log_), testing::Contains("light"));
}

TEST_F(ServiceTest, TellsOfALampLitByHandWhatEndedIt) {
    const std::vector<std::pair<std::string, std::function<void()>>> ends{
        {"the door of the box is open", [] { throw DoorOpen("the door of the box is open", "close it"); }},
        {"cancelled before it began", [] { throw Cancelled("cancelled before it began", "ask again"); }}};
    Service& service = start_idle();
    for (const auto& [what, thrown] : ends) {
        while_lit_ = [&thrown = thrown](const WorkContext&) { thrown(); };
        const std::uint64_t before = service.light({LampId{0}, Seconds(1), ""});
        EXPECT_TRUE(eventually([&] { return log_.last() > before && event_types(log_).back() == "light"; }));
        EXPECT_EQ(all_events(log_).back().at("lit"), false);
        EXPECT_EQ(all_events(log_).back().at("detail"), what);
        EXPECT_FALSE(script_.lit);
        EXPECT_EQ(service.status().state, ServiceState::idle);
    }
}

TEST_F(ServiceTest, RefusesToRecalibrateWithACard) {
    Service& service = start_idle();
    Job job;
    job.kind = JobKind::recalibrate;
    job.orders = {{"plan", "flat"}};
    try {
        service.enqueue(job);
        FAIL() << "accepted";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("not of a card"));
    }
    job.orders = {{"plan", "lit"}};
    EXPECT_NO_THROW(service.enqueue(job));
}

TEST_F(ServiceTest, OpensTheRigOnceItIsThere) {
    script_.failing_opens = 3;
    Service& service = start();
    EXPECT_TRUE(reaches(service, ServiceState::idle));
    // The same problem is told once, not at every try.
    EXPECT_THAT(event_types(log_), ElementsAre("state", "state"));
    EXPECT_EQ(all_events(log_).front().at("problem"), "camera: not plugged in");
}

TEST_F(ServiceTest, CancelEndsTheCaptureInTheDark) {
    Service& service = start_busy();
    const std::uint64_t id = service.status().running->id;
    service.cancel(id);
    EXPECT_EQ(end_of(service, id), JobState::cancelled);
    EXPECT_THAT(service.job(id).failure.hint, HasSubstr("--resume " + service.job(id).session));
    EXPECT_FALSE(script_.lit);
    EXPECT_EQ(service.status().state, ServiceState::idle);
    // Cancelling what has ended changes nothing.
    EXPECT_EQ(service.cancel(id).state, JobState::cancelled);
}

TEST_F(ServiceTest, DarkenWhileBusyCancels) {
    Service& service = start_busy();
    const std::uint64_t id = service.status().running->id;
    service.darken();
    EXPECT_EQ(end_of(service, id), JobState::cancelled);
    EXPECT_FALSE(script_.lit);
}

TEST_F(ServiceTest, AFailureOfAnyKindLeavesTheLampsDarkAndTheReasonTold) {
    const std::vector<std::pair<std::string, std::function<void()>>> failures{
        {"lamp-04 frame 7", [] { throw InputError("lamp-04 frame 7", "look at it"); }},
        {"disk is full", [] { throw DeviceError("disk is full", "free space"); }},
        {"vector", [] { throw std::runtime_error("vector"); }},
        {"out of memory", [] { throw std::bad_alloc(); }},
        {"unknown error", [] { throw 42; }},
    };
    Service& service = start_idle();
    int tries = 0;
    for (const auto& [what, thrown] : failures) {
        script_.body = [&thrown = thrown](const auto&, const auto&) { thrown(); };
        const Job job = service.start_capture({.object = "vase", .name = "try-" + std::to_string(++tries)});
        EXPECT_EQ(end_of(service, job.id), JobState::failed);
        EXPECT_THAT(service.job(job.id).failure.what, HasSubstr(what));
        EXPECT_FALSE(service.job(job.id).failure.hint.empty());
        EXPECT_EQ(service.status().state, ServiceState::idle);
        EXPECT_FALSE(script_.lit);
        EXPECT_EQ(all_events(log_).back().at("event"), "failed");
    }
}

TEST_F(ServiceTest, LampsThatMayBeLitAreAFaultUntilTheyAreProvenDark) {
    Service& service = start_idle();
    script_.dark_fails = true;
    const Job job = service.start_capture({.object = "vase"});
    EXPECT_TRUE(reaches(service, ServiceState::fault));
    EXPECT_EQ(service.job(job.id).state, JobState::done);
    EXPECT_THAT(service.status().problem, HasSubstr("lamp board"));
    service.darken();
    EXPECT_TRUE(eventually([this] { return event_types(log_).back() == "state"; }));
    EXPECT_EQ(service.status().state, ServiceState::fault);
    script_.dark_fails = false;
    service.darken();
    EXPECT_TRUE(reaches(service, ServiceState::idle));
    EXPECT_TRUE(service.status().problem.empty());
    EXPECT_FALSE(script_.lit);
}

TEST_F(ServiceTest, ResumesByName) {
    std::filesystem::create_directory(folder_.path() / "begun");
    script_.body = [this](const CaptureRequest& request, const WorkContext&) {
        EXPECT_EQ(request.folder, folder_.path() / "begun");
        EXPECT_EQ(request.start, CaptureStart::resume);
    };
    Service& service = start_idle();
    const Job job = service.start_capture({.resume = "begun"});
    EXPECT_EQ(job.session, "begun");
    EXPECT_EQ(end_of(service, job.id), JobState::done);
}

TEST_F(ServiceTest, RefusesOrdersThatMakeNoSense) {
    std::filesystem::create_directory(folder_.path() / "there");
    Service& service = start_idle();
    EXPECT_THROW(service.start_capture({.resume = "absent"}), NotFound);
    EXPECT_THROW(service.start_capture({.name = "there"}), InputError);
    EXPECT_THROW(service.start_capture({.object = "vase", .resume = "there"}), InputError);
    for (const char* name : {"..", ".hidden", "a/b", "/etc", "a\\b", "über", "a b", "../there"})
        EXPECT_THROW(service.start_capture({.name = name}), InputError) << name;
    EXPECT_THROW(service.start_capture({.name = std::string(101, 'a')}), InputError);
    EXPECT_THROW(service.start_capture({.name = std::string("a\0b", 3)}), InputError);
    EXPECT_THROW(service.start_capture({.resume = ".."}), InputError);
    EXPECT_THROW(service.start_capture({.resume = ""}), InputError);
    EXPECT_EQ(script_.captures, 0);
    EXPECT_EQ(service.status().state, ServiceState::idle);
}

TEST_F(ServiceTest, KnowsNoJobThatNeverWas) {
    Service& service = start_idle();
    EXPECT_THROW((void)service.job(1), NotFound);
    EXPECT_THROW(service.cancel(1), NotFound);
}

TEST_F(ServiceTest, ForgetsTheOldestJobs) {
    ServiceOptions options;
    options.sessions = folder_.path();
    options.jobs_kept = 2;
    Service service(open_fake(script_), options, log_);
    ASSERT_TRUE(reaches(service, ServiceState::idle));
    for (std::uint64_t id = 1; id <= 3; ++id) {
        EXPECT_EQ(service.start_capture({.object = "vase"}).id, id);
        EXPECT_EQ(end_of(service, id), JobState::done);
    }
    EXPECT_THROW((void)service.job(1), NotFound);
    EXPECT_EQ(service.job(3).state, JobState::done);
}

TEST_F(ServiceTest, StoppingCancelsDarkensClosesAndTellsOfIt) {
    Service& service = start_busy();
    service.request_stop();
    EXPECT_TRUE(eventually([this] { return log_.closed(); }));
    EXPECT_FALSE(script_.lit);
    EXPECT_FALSE(script_.open);
    EXPECT_THAT(event_types(log_), testing::Contains("cancelled"));
    EXPECT_THAT(refusal(service), HasSubstr("shutting down"));
}

TEST_F(ServiceTest, DestroyingItWhileBusyLeavesTheLampsDark) {
    start_busy();
    service_.reset();
    EXPECT_FALSE(script_.lit);
    EXPECT_FALSE(script_.open);
}

TEST_F(ServiceTest, StopsWhileOffline) {
    Service& service = start_offline();
    service.request_stop();
    EXPECT_TRUE(eventually([this] { return log_.closed(); }));
}

}  // namespace
}  // namespace darkbox
