#include "rig/cli/followed_job.h"

#include <fmt/format.h>

#include "acquisition/device/device_error.h"

namespace darkbox {

using EventJson = DaemonClient::Json;

FollowedJob::FollowedJob(const DaemonClient& client, const EventJson& job, const WorkContext& work, std::string remedy)
    : client_(client), id_(job.at("id")), remedy_(std::move(remedy)), first_event_(job.at("event")), work_(work) {}

EventJson FollowedJob::end() {
    try {
        client_.follow_events(first_event_, {.event = [this](const EventJson& event) { return hear(event); },
                                             .idle = [this] { cancel_if_asked(); }});
    } catch (const DeviceError& error) {
        stopped_early(fmt::format(": {}", error.what()));
    }
    if (end_.is_null()) stopped_early("");
    return std::move(end_);
}

void FollowedJob::stopped_early(const std::string& why) const {
    throw DeviceError("darkboxd stopped before the job was done" + why, remedy_);
}

DaemonClient::Follow FollowedJob::hear(const EventJson& event) {
    cancel_if_asked();
    if (event.value("job", std::uint64_t{0}) != id_) return DaemonClient::Follow::go_on;
    if (event.at("event") == "progress") {
        work_.tell({event.at("stage"), event.at("done"), event.at("total"), event.at("detail")});
        return DaemonClient::Follow::go_on;
    }
    end_ = event;
    return DaemonClient::Follow::leave;
}

void FollowedJob::cancel_if_asked() {
    if (!work_.cancelled() || asked_) return;
    asked_ = true;
    client_.call("DELETE", fmt::format("jobs/{}", id_));
}

}  // namespace darkbox
