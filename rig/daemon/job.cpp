#include "rig/daemon/job.h"

#include <array>
#include <utility>

namespace darkbox {
namespace {

constexpr std::array kinds{std::pair{JobKind::capture, "capture"},     std::pair{JobKind::recalibrate, "recalibrate"},
                           std::pair{JobKind::calibrate, "calibrate"}, std::pair{JobKind::process, "process"},
                           std::pair{JobKind::export_map, "export"},   std::pair{JobKind::prune, "prune"}};
constexpr std::array states{std::pair{JobState::queued, "queued"}, std::pair{JobState::running, "running"},
                            std::pair{JobState::done, "done"}, std::pair{JobState::cancelled, "cancelled"},
                            std::pair{JobState::failed, "failed"}};

template <typename Table, typename Value>
std::string_view name_in(const Table& table, Value value) {
    for (const auto& [known, name] : table)
        if (known == value) return name;
    return "";
}

template <typename Value, typename Table>
std::optional<Value> value_in(const Table& table, std::string_view name) {
    for (const auto& [value, known] : table)
        if (known == name) return value;
    return std::nullopt;
}

void add_outcome(const Job& job, nlohmann::json& json) {
    if (lane_of(job.kind) == Lane::processing) {
        json["result"] = job.result;
        return;
    }
    json["folder"] = job.outcome.session.string();
    json["frames"] = job.outcome.frames;
    json["resumed"] = job.outcome.resumed;
    json["repeated"] = job.outcome.repeated;
    json["most_queued_bytes"] = job.outcome.most_queued;
    json["seconds"] = job.outcome.duration.count();
    json["findings"] = job.outcome.findings;
}

}  // namespace

std::string_view name(JobKind kind) { return name_in(kinds, kind); }
std::optional<JobKind> job_kind_from_name(std::string_view name) { return value_in<JobKind>(kinds, name); }
std::string_view name(JobState state) { return name_in(states, state); }
std::optional<JobState> job_state_from_name(std::string_view name) { return value_in<JobState>(states, name); }

Lane lane_of(JobKind kind) {
    return kind == JobKind::capture || kind == JobKind::recalibrate ? Lane::rig : Lane::processing;
}

nlohmann::json to_json(const Job& job) {
    nlohmann::json json{{"id", job.id},
                        {"kind", name(job.kind)},
                        {"session", job.session},
                        {"state", name(job.state)},
                        {"orders", job.orders},
                        {"attempts", job.attempts},
                        {"created", job.created},
                        {"event", job.event},
                        {"progress",
                         {{"stage", job.progress.stage},
                          {"done", job.progress.done},
                          {"total", job.progress.total},
                          {"detail", job.progress.detail}}}};
    if (!job.started.empty()) json["started"] = job.started;
    if (!job.ended.empty()) json["ended"] = job.ended;
    if (job.next != 0) json["next"] = job.next;
    if (job.state == JobState::done) add_outcome(job, json);
    if (job.state == JobState::cancelled || job.state == JobState::failed) {
        json["detail"] = job.failure.what;
        json["hint"] = job.failure.hint;
    }
    return json;
}

}  // namespace darkbox
