#pragma once

#include <string>

#include "acquisition/frame/progress.h"
#include "rig/daemon/client.h"

namespace darkbox {

/// Follows one of darkboxd's jobs from its acceptance to its last event; asks for its end once when the context is
/// cancelled. Thread-compatible.
class FollowedJob {
public:
    /// `job` as darkboxd answered; `remedy` is said when darkboxd stops before the job ends. `client` and `work` must
    /// outlive this.
    FollowedJob(const DaemonClient& client, const DaemonClient::Json& job, const WorkContext& work, std::string remedy);

    /// The last event: "done", "cancelled" or "failed". Throws DeviceError when the events stop before.
    DaemonClient::Json end();

private:
    [[noreturn]] void stopped_early(const std::string& why) const;
    DaemonClient::Follow hear(const DaemonClient::Json& event);
    void cancel_if_asked();

    const DaemonClient& client_;
    const std::uint64_t id_;
    const std::string remedy_;
    const std::uint64_t first_event_;
    const WorkContext& work_;
    bool asked_ = false;
    DaemonClient::Json end_;
};

}  // namespace darkbox
