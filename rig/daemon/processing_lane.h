#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "rig/daemon/job_book.h"

namespace darkbox {

/// Runs one processing job to its end and returns what it found. Throws Cancelled when the context asks for it, else
/// Error. `note` takes lines for the job's log.
using RunProcessing =
    std::function<nlohmann::json(const Job& job, const std::filesystem::path& session, const WorkContext& work,
                                 const std::function<void(const std::string&)>& note)>;

/// The second lane: processing jobs one after the other, on a thread of its own. What runs when it is stopped goes back
/// into the queue. Thread-safe.
class ProcessingLane {
public:
    /// Without `run` it takes nothing from the queue.
    ProcessingLane(JobBook& book, Catalog& catalog, RunProcessing run);
    ProcessingLane(const ProcessingLane&) = delete;
    ProcessingLane& operator=(const ProcessingLane&) = delete;
    ~ProcessingLane();

    void request_stop() noexcept;

private:
    void run(const std::stop_token& stop);
    void perform(Job job, const std::stop_token& stop);

    JobBook& book_;
    Catalog& catalog_;
    const RunProcessing run_;
    std::jthread thread_;
};

}  // namespace darkbox
