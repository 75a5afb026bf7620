#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/session.h"
#include "rig/daemon/client.h"
#include "tests/support/child_process.h"

namespace darkbox::test {

/// darkboxd, as built, with its socket and its sessions in a folder. The destructor kills it.
class Daemon {
public:
    using Json = nlohmann::json;

    /// `through`: a command that runs it, "/usr/bin/setsid". Returns once it answers and its rig is open.
    Daemon(const std::filesystem::path& folder, const std::filesystem::path& rig,
           const std::vector<std::string>& through = {});

    /// Starts a capture of these lamps, all when none is named; says how it went once ended() waited for it.
    void start_capture(const std::string& object, const std::vector<std::string>& lamps = {});
    /// The capture's last event: "event" is done, failed or cancelled; with "folder", or "detail" and "hint".
    Json ended();

    int process() const { return process_; }
    /// That of its own child process which holds the lamps' lines.
    int guardian() const;
    std::filesystem::path sessions() const { return folder_ / "sessions"; }
    Session session(const std::string& object) const { return Session::open(sessions() / object); }
    /// Copies that session to where the host finds it when the machine is off.
    void hand_out(const std::string& object) const;
    void signal(int number) const;
    int wait() { return child_.wait(); }
    std::string log() const { return child_.err(); }

private:
    std::filesystem::path folder_;
    ChildProcess child_;
    DaemonClient client_;
    int process_ = 0;
    std::uint64_t capture_ = 0;
};

}  // namespace darkbox::test
