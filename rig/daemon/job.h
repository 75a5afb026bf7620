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
    std::vector<std::string> lamps = {};          ///< names; empty = all
    std::optional<SyncMode> mode = {};            ///< none: the one of rig.toml
    std::optional<ExposureChoice> exposure = {};  ///< none: as rig.toml says
    FrameKind kind = FrameKind::lit;              ///< or flat: of a card in the object's place
    std::optional<std::string> flats_from = {};   ///< name of a sealed session of kind flat that tells intensities
    std::optional<std::string> retake = {};       ///< name of a sealed session whose `lamps` are to be taken again
    std::string name = {};                        ///< of the session; empty = made from object and date
    std::optional<std::string> resume = {};       ///< name of an interrupted session
    ObjectRecord record = {};                     ///< of the object
};

enum class JobKind {
    capture,
    recalibrate,  ///< a capture of the ball, then a job of kind calibrate
    calibrate,
    process,     ///< all stages, then the report
    export_map,  ///< into another program's format
    prune,       ///< removes sessions by the rules of [retention]; has no session of its own
};
std::string_view name(JobKind kind);
std::optional<JobKind> job_kind_from_name(std::string_view name);

/// Jobs of one lane run one after the other, in the order in which they were asked for.
enum class Lane { rig, processing };
Lane lane_of(JobKind kind);

enum class JobState { queued, running, done, cancelled, failed };
std::string_view name(JobState state);
std::optional<JobState> job_state_from_name(std::string_view name);

/// Why something did not work, for people.
struct Failure {
    bool cancelled = false;  ///< asked for, so no failure after all
    std::string what = {};
    std::string hint = {};
};

/// Something that the service was asked for.
struct Job {
    std::uint64_t id = 0;
    JobKind kind = JobKind::capture;
    std::string session = {};  ///< name of its folder; empty until a queued capture begins
    JobState state = JobState::queued;
    nlohmann::json orders = nlohmann::json::object();  ///< what was asked, in the API's words
    int attempts = 0;                                  ///< how often it was begun; above 1 after a crash
    std::string created = {};                          ///< ISO 8601, UTC; so are the next two
    std::string started = {};
    std::string ended = {};
    ProgressUpdate progress = {};
    CaptureOutcome outcome = {};      ///< of a capture, when done
    nlohmann::json result = nullptr;  ///< of processing, when done: what the command prints with --json
    Failure failure = {};             ///< when cancelled or failed
    std::uint64_t next = 0;           ///< the job that follows from this one, when done; 0 = none
    std::uint64_t event = 0;          ///< everything about this job has a higher event number

    bool ended_already() const { return state != JobState::queued && state != JobState::running; }
};

nlohmann::json to_json(const Job& job);

/// Where below SESSION/exports an export into this format goes; no value for an unknown format.
std::optional<std::string> export_target(const std::string& format);

}  // namespace darkbox
