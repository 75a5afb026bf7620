#include "rig/daemon/job.h"

namespace darkbox {

std::string_view name(JobState state) {
    switch (state) {
        case JobState::running:
            return "running";
        case JobState::done:
            return "done";
        case JobState::cancelled:
            return "cancelled";
        case JobState::failed:
            break;
    }
    return "failed";
}

nlohmann::json to_json(const Job& job) {
    nlohmann::json json{{"id", job.id},
                        {"session", job.session},
                        {"state", name(job.state)},
                        {"event", job.event},
                        {"progress",
                         {{"stage", job.progress.stage},
                          {"done", job.progress.done},
                          {"total", job.progress.total},
                          {"detail", job.progress.detail}}}};
    if (job.state == JobState::done) {
        json["folder"] = job.outcome.session.string();
        json["frames"] = job.outcome.frames;
        json["resumed"] = job.outcome.resumed;
        json["repeated"] = job.outcome.repeated;
        json["seconds"] = job.outcome.duration.count();
    } else if (job.state != JobState::running) {
        json["detail"] = job.failure.what;
        json["hint"] = job.failure.hint;
    }
    return json;
}

}  // namespace darkbox
