#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/frame/progress.h"
#include "rig/daemon/capture_rig.h"

namespace darkbox {

/// What a listener asks the service to capture. Exactly one of a new session and one to resume.
struct CaptureOrder {
    std::string object = {};
    std::vector<std::string> lamps = {};     ///< names; empty = all
    std::optional<SyncMode> mode = {};       ///< none: the one of rig.toml
    std::string name = {};                   ///< of the session; empty = made from object and date
    std::optional<std::string> resume = {};  ///< name of an interrupted session
};

enum class JobState { running, done, cancelled, failed };
std::string_view name(JobState state);

/// Why something did not work, for people.
struct Failure {
    bool cancelled = false;  ///< asked for, so no failure after all
    std::string what = {};
    std::string hint = {};
};

/// One capture that the service was asked for.
struct Job {
    std::uint64_t id = 0;
    std::string session = {};  ///< name of its folder
    JobState state = JobState::running;
    ProgressUpdate progress = {};
    CaptureOutcome outcome = {};  ///< when done
    Failure failure = {};         ///< when cancelled or failed
    std::uint64_t event = 0;      ///< everything about this job has a higher event number
};

nlohmann::json to_json(const Job& job);

}  // namespace darkbox
