#include "rig/daemon/job_book.h"

#include <gmock/gmock.h>

#include <fstream>
#include <latch>
#include <thread>

#include "acquisition/session/session_writer.h"
#include "tests/rig/daemon/fake_rig.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace test;
using nlohmann::json;
using testing::HasSubstr;
using testing::SizeIs;

class JobBookTest : public testing::Test {
protected:
    /// As a daemon that was killed leaves it: nothing is told to the book, it is opened anew.
    JobBook& restart() {
        book_.reset();
        catalog_.reset();
        catalog_.emplace(folder_.path());
        book_.emplace(*catalog_, log_, 3);
        return *book_;
    }
    static Job capture(const json& orders = json::object()) {
        Job job;
        job.orders = orders;
        return job;
    }
    static Job process(const std::string& session) {
        Job job;
        job.kind = JobKind::process;
        job.session = session;
        return job;
    }
    SessionWriter begin(const std::string& name) const {
        SessionInfo info;
        info.created = iso8601_now();
        info.source = "import";
        info.planned_shots = 1;
        return SessionWriter::create(folder_.path() / name, info);
    }
    void seal(const std::string& name) const {
        SessionWriter writer = begin(name);
        FrameRecord record;
        record.file = "frames/one.png";
        record.format = "png";
        record.width = record.height = 1;
        writer.add(std::as_bytes(std::span("x", 1)), record);
        writer.seal();
    }

    TemporaryFolder folder_;
    EventLog log_;
    std::optional<Catalog> catalog_;
    std::optional<JobBook> book_;
};

TEST_F(JobBookTest, GivesOutEachLaneInTheOrderOfAsking) {
    JobBook& book = restart();
    const auto first = book.add(capture()).id;
    const auto other = book.add(process("a")).id;
    const auto second = book.add(capture()).id;
    EXPECT_EQ(book.take(Lane::rig)->id, first);
    EXPECT_EQ(book.take(Lane::processing)->id, other);
    EXPECT_EQ(book.take(Lane::rig)->id, second);
    EXPECT_FALSE(book.take(Lane::rig));
    EXPECT_EQ(book.find(first).state, JobState::running);
    EXPECT_EQ(book.unfinished(Lane::rig), 2u);
}

TEST_F(JobBookTest, TheQueueSurvivesARestart) {
    const auto first = restart().add(capture({{"object", "a"}})).id;
    const auto second = book_->add(process("b")).id;
    JobBook& book = restart();
    const auto job = book.take(Lane::rig);
    ASSERT_TRUE(job);
    EXPECT_EQ(job->id, first);
    EXPECT_EQ(job->orders.at("object"), "a");
    EXPECT_EQ(book.take(Lane::processing)->id, second);
    EXPECT_GT(book.add(capture()).id, second);
}

TEST_F(JobBookTest, KnowsTheSessionsThatWaitingJobsNeed) {
    JobBook& book = restart();
    book.add(capture({{"object", "vase"}, {"flats_from", "card"}}));
    book.add(capture({{"retake", "cup-1"}}));
    book.add(capture({{"resume", "bowl-1"}}));
    book.add(process("dish-1"));
    EXPECT_THAT(book.sessions_in_use(), testing::UnorderedElementsAre("card", "cup-1", "bowl-1", "dish-1"));
}

TEST_F(JobBookTest, ACutOffCaptureGoesOnWithItsSession) {
    Job job = restart().add(capture({{"object", "vase"}, {"process", true}}));
    book_->take(Lane::rig);
    book_->set_session(job.id, "vase-1");
    {
        const SessionWriter left = begin("vase-1");
    }
    const auto resumed = restart().take(Lane::rig);
    ASSERT_TRUE(resumed);
    EXPECT_EQ(resumed->id, job.id);
    EXPECT_EQ(resumed->orders, json({{"resume", "vase-1"}, {"process", true}}));
    EXPECT_EQ(resumed->attempts, 2);
}

TEST_F(JobBookTest, ACutOffCaptureGoesOnWithoutTheOrdersThatItsSessionKnows) {
    const json orders = {{"object", "vase"},  {"inventory", "V 1"},   {"dublin_core", {{"title", "A vase"}}},
                         {"name", "vase-1"},  {"exposure", "auto"},   {"lamps", {"lamp-01"}},
                         {"mode", "settled"}, {"flats_from", "card"}, {"process", true}};
    restart().add(capture(orders));
    restart().add(capture({{"retake", "vase-1"}, {"lamps", {"lamp-01"}}}));
    restart().add(capture({{"plan", "flat"}}));
    for (const char* name : {"vase-1", "vase-2", "card-2"}) {
        const auto job = book_->take(Lane::rig);
        book_->set_session(job->id, name);
        const SessionWriter left = begin(name);
    }
    restart();
    EXPECT_EQ(book_->take(Lane::rig)->orders, json({{"resume", "vase-1"}, {"mode", "settled"}, {"process", true}}));
    EXPECT_EQ(book_->take(Lane::rig)->orders, json({{"resume", "vase-2"}}));
    EXPECT_EQ(book_->take(Lane::rig)->orders, json({{"resume", "card-2"}}));
}

TEST_F(JobBookTest, ACutOffCaptureThatHadNotBegunKeepsItsName) {
    const Job job = restart().add(capture({{"object", "vase"}}));
    book_->take(Lane::rig);
    book_->set_session(job.id, "vase-1");
    const auto again = restart().take(Lane::rig);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->orders, json({{"object", "vase"}, {"name", "vase-1"}}));
}

TEST_F(JobBookTest, ACaptureCutOffAfterItsSealIsDoneAndWhatFollowsIsQueued) {
    const Job job = restart().add(capture({{"process", true}}));
    book_->take(Lane::rig);
    book_->set_session(job.id, "vase-1");
    seal("vase-1");
    JobBook& book = restart();
    EXPECT_EQ(book.find(job.id).state, JobState::done);
    EXPECT_EQ(book.find(job.id).outcome.frames, 1u);
    const auto next = book.take(Lane::processing);
    ASSERT_TRUE(next);
    EXPECT_EQ(next->kind, JobKind::process);
    EXPECT_EQ(next->session, "vase-1");
    EXPECT_EQ(book.find(job.id).next, next->id);
    // Once only.
    EXPECT_FALSE(restart().take(Lane::rig));
}

TEST_F(JobBookTest, WhatTakesTheDaemonDownAgainAndAgainFails) {
    const Job job = restart().add(process("a"));
    for (int i = 0; i < 3; ++i) {
        ASSERT_TRUE(book_->take(Lane::processing)) << i;
        restart();
    }
    EXPECT_FALSE(book_->take(Lane::processing));
    EXPECT_EQ(book_->find(job.id).state, JobState::failed);
    EXPECT_THAT(book_->find(job.id).failure.what, HasSubstr("3 times"));
}

TEST_F(JobBookTest, PutBackDoesNotCountAsAnAttempt) {
    const Job job = restart().add(process("a"));
    for (int i = 0; i < 5; ++i) {
        ASSERT_TRUE(book_->take(Lane::processing)) << i;
        EXPECT_TRUE(book_->put_back(job.id));
        restart();
    }
    EXPECT_EQ(book_->take(Lane::processing)->attempts, 1);
}

TEST_F(JobBookTest, WhatSomebodyCancelledIsNotPutBack) {
    const Job job = restart().add(process("a"));
    ASSERT_TRUE(book_->take(Lane::processing));
    book_->cancel(job.id);
    EXPECT_FALSE(book_->put_back(job.id));
    EXPECT_EQ(book_->find(job.id).state, JobState::running);
}

TEST_F(JobBookTest, CancelsWhatWaitsAtOnceAndAsksWhatRuns) {
    JobBook& book = restart();
    const auto running = book.add(capture()).id;
    const auto waiting = book.add(capture()).id;
    book.take(Lane::rig);
    EXPECT_EQ(book.cancel(waiting).state, JobState::cancelled);
    EXPECT_EQ(book.cancel(running).state, JobState::running);
    EXPECT_TRUE(book.stop_token(running).stop_requested());
    EXPECT_FALSE(book.take(Lane::rig));
    EXPECT_EQ(event_types(log_).back(), "cancelled");
}

TEST_F(JobBookTest, WhatIsCancelledAsALaneTakesItIsCancelledOrAskedToStop) {
    JobBook& book = restart();
    for (int i = 0; i < 200; ++i) {
        const auto id = book.add(process("a")).id;
        std::optional<Job> taken;
        std::latch together(2);
        {
            const std::jthread lane([&] {
                together.arrive_and_wait();
                taken = book.take(Lane::processing);
            });
            together.arrive_and_wait();
            book.cancel(id);
        }
        if (!taken) {
            EXPECT_EQ(book.find(id).state, JobState::cancelled) << i;
            continue;
        }
        EXPECT_EQ(book.find(id).state, JobState::running) << i;
        ASSERT_TRUE(book.stop_token(id).stop_requested()) << i;
        taken->state = JobState::cancelled;
        book.finish(std::move(*taken));
    }
}

TEST_F(JobBookTest, KeepsTheLastJobsAndTheirLogsOnly) {
    JobBook& book = restart();
    for (int i = 0; i < 5; ++i) {
        Job job = book.add(capture());
        book.note(job.id, "a line");
        job.state = JobState::done;
        book.finish(job);
    }
    EXPECT_THAT(book.list({}), SizeIs(3));
    EXPECT_EQ(book.list({.after = "4", .limit = 1}).at(0).id, 3u);
    EXPECT_THROW((void)book.find(1), NotFound);
    EXPECT_FALSE(fs::exists(book.log_file(1)));
    std::ifstream log(book.log_file(5));
    std::string line;
    ASSERT_TRUE(std::getline(log, line));
    EXPECT_THAT(line, HasSubstr("Z a line"));
}

// Through the service.

class QueueTest : public testing::Test {
protected:
    void start(RunProcessing run = {}) {
        service_.emplace(open_fake(script_),
                         ServiceOptions{.sessions = folder_.path(), .run_processing = std::move(run)}, log_);
    }
    JobState end_of(std::uint64_t id) const {
        EXPECT_TRUE(eventually([&] { return service_->job(id).ended_already(); }));
        return service_->job(id).state;
    }
    static Job of(JobKind kind, const std::string& session, const json& orders = json::object()) {
        Job job;
        job.kind = kind;
        job.session = session;
        job.orders = orders;
        return job;
    }
    /// What the catalogue and the queue take for a sealed session.
    static void pretend_seal(const CaptureRequest& request, const WorkContext&) { pretend_seal_at(request.folder); }
    static void pretend_seal_at(const fs::path& session) {
        fs::create_directories(session / "data");
        std::ofstream(session / "tagmanifest-sha256.txt") << "";
    }

    TemporaryFolder folder_;
    FakeRigScript script_;
    EventLog log_;
    std::optional<Service> service_;
};

TEST_F(QueueTest, CapturesWaitForTheRigAndForEachOther) {
    Gate gate;
    std::atomic<int> at_once = 0;
    script_.body = [&](const auto&, const auto&) {
        EXPECT_EQ(++at_once, 1);
        gate.wait();
        --at_once;
    };
    script_.failing_opens = 1;
    start();
    const auto first = service_->enqueue(of(JobKind::capture, "", {{"object", "a"}})).id;
    const auto second = service_->enqueue(of(JobKind::capture, "", {{"object", "b"}})).id;
    EXPECT_TRUE(eventually([&] { return at_once == 1; }));
    EXPECT_EQ(service_->job(second).state, JobState::queued);
    EXPECT_EQ(service_->status().queued, 1u);
    gate.open();
    EXPECT_EQ(end_of(first), JobState::done);
    EXPECT_EQ(end_of(second), JobState::done);
    EXPECT_THAT(service_->job(second).session, testing::StartsWith("b-"));
}

TEST_F(QueueTest, WhatIsQueuedIsCapturedAfterAnOrderlyRestart) {
    script_.body = run_until_cancelled;
    start();
    ASSERT_TRUE(reaches(*service_, ServiceState::idle));
    const auto running = service_->start_capture({.object = "a"}).id;
    const auto waiting = service_->enqueue(of(JobKind::capture, "", {{"object", "b"}})).id;
    service_.reset();
    script_.body = [](const auto&, const auto&) {};
    start();
    EXPECT_EQ(end_of(waiting), JobState::done);
    EXPECT_EQ(service_->job(running).state, JobState::cancelled);  // an orderly stop is somebody's wish
}

TEST_F(QueueTest, ProcessingFollowsACaptureAndSpeaksForItself) {
    script_.body = pretend_seal;
    start([](const Job& job, const fs::path& session, const WorkContext& work, const auto& note) -> json {
        EXPECT_EQ(job.kind, JobKind::process);
        EXPECT_EQ(session.filename(), "cup");
        work.tell({"normals", 1, 2, ""});
        note("a line");
        return {{"residual_rms", 0.5}};
    });
    const auto id = service_->enqueue(of(JobKind::capture, "", {{"name", "cup"}, {"process", true}})).id;
    ASSERT_EQ(end_of(id), JobState::done);
    const auto next = service_->job(id).next;
    ASSERT_EQ(end_of(next), JobState::done);
    const Job processed = service_->job(next);
    EXPECT_EQ(processed.result.at("residual_rms"), 0.5);
    EXPECT_EQ(processed.progress.stage, "normals");
    EXPECT_GT(fs::file_size(service_->job_log(next)), 10u);
}

TEST_F(QueueTest, ARecalibrationIsACaptureAndThenACalibration) {
    script_.body = pretend_seal;
    std::atomic<bool> calibrated = false;
    start([&](const Job& job, const fs::path&, const auto&, const auto&) -> json {
        calibrated = job.kind == JobKind::calibrate;
        return json::object();
    });
    const auto id = service_->enqueue(of(JobKind::recalibrate, "", json::object())).id;
    ASSERT_EQ(end_of(id), JobState::done);
    ASSERT_EQ(end_of(service_->job(id).next), JobState::done);
    EXPECT_TRUE(calibrated);
    EXPECT_THAT(service_->job(id).session, testing::StartsWith("recalibration-"));
}

TEST_F(QueueTest, ProcessingGoesBackIntoTheQueueWhenTheServiceStops) {
    pretend_seal_at(folder_.path() / "cup");
    std::atomic<bool> runs = false;
    start([&](const auto&, const auto&, const WorkContext& work, const auto&) -> json {
        runs = true;
        while (!work.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        throw Cancelled("cancelled", "");
    });
    const auto id = service_->enqueue(of(JobKind::process, "cup")).id;
    ASSERT_TRUE(eventually([&] { return runs.load(); }));
    service_.reset();
    start([](const auto&, const auto&, const auto&, const auto&) { return json::object(); });
    EXPECT_EQ(end_of(id), JobState::done);
}

TEST_F(QueueTest, CancelsProcessing) {
    pretend_seal_at(folder_.path() / "cup");
    start([&](const auto&, const auto&, const WorkContext& work, const auto&) -> json {
        while (!work.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        throw Cancelled("cancelled", "");
    });
    const auto id = service_->enqueue(of(JobKind::process, "cup")).id;
    service_->cancel(id);
    EXPECT_EQ(end_of(id), JobState::cancelled);
}

TEST_F(QueueTest, RefusesProcessingThatCannotBe) {
    start();
    EXPECT_THROW(service_->enqueue(of(JobKind::process, "cup")), Refused);
    service_.reset();
    start([](const auto&, const auto&, const auto&, const auto&) { return json::object(); });
    EXPECT_THROW(service_->enqueue(of(JobKind::process, "cup")), NotFound);
    EXPECT_THROW(service_->enqueue(of(JobKind::process, "../cup")), InputError);
    EXPECT_THROW(service_->enqueue(of(JobKind::capture, "", {{"resume", "absent"}})), NotFound);
}

TEST_F(QueueTest, OneDaemonHasTheFolder) {
    start();
    EXPECT_THROW(Service(open_fake(script_), ServiceOptions{.sessions = folder_.path()}, log_), InputError);
}

}  // namespace
}  // namespace darkbox
