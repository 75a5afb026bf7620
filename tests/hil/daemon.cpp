#include "tests/hil/daemon.h"

#include <fmt/format.h>

#include <chrono>
#include <stdexcept>

#include "tests/hil/machine.h"

namespace darkbox::test {

namespace fs = std::filesystem;

namespace {

std::vector<std::string> command(const fs::path& folder, const fs::path& rig, std::vector<std::string> words) {
    for (const std::string& word :
         {program("darkboxd"), std::string("--config"), rig.string(), std::string("--socket"),
          (folder / "socket").string(), std::string("--sessions"), (folder / "sessions").string()})
        words.push_back(word);
    return words;
}

int parent_of(int process) {
    const std::string stat = text_of(fmt::format("/proc/{}/stat", process));
    const std::size_t name_end = stat.rfind(')');
    return name_end == std::string::npos ? 0 : std::stoi(stat.substr(name_end + 4));
}

}  // namespace

Daemon::Daemon(const fs::path& folder, const fs::path& rig, const std::vector<std::string>& through)
    : folder_(folder), child_(command(folder, rig, through), folder / "darkboxd"), client_(folder / "socket") {
    const auto open = [&] { return client_.answers() && client_.call("GET", "status").at("state") == "Idle"; };
    if (!comes_true(open, start_of_a_program)) throw std::runtime_error("darkboxd does not start: " + log());
    const std::vector<int> all = processes("darkboxd");
    if (all.size() != 1) throw std::runtime_error("there are other processes of the name darkboxd");
    process_ = all.front();
}

void Daemon::start_capture(const std::string& object, const std::vector<std::string>& lamps) {
    Json order{{"object", object}, {"name", object}};
    if (!lamps.empty()) order["lamps"] = lamps;
    capture_ = client_.call("POST", "captures", order).at("id");
}

Daemon::Json Daemon::ended() {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(200);
    Json end;
    const auto hear = [&](const Json& event) {
        const std::string what = event.at("event");
        if (event.value("job", std::uint64_t{0}) != capture_) return DaemonClient::Follow::go_on;
        if (what != "done" && what != "failed" && what != "cancelled") return DaemonClient::Follow::go_on;
        end = event;
        return DaemonClient::Follow::leave;
    };
    const auto look_at_clock = [&] {
        if (std::chrono::steady_clock::now() >= limit) throw std::runtime_error("the capture does not end: " + log());
    };
    client_.follow_events(0, {.event = hear, .idle = look_at_clock});
    return end;
}

int Daemon::guardian() const {
    for (const int process : processes("darkbox-guard"))
        if (parent_of(process) == process_) return process;
    throw std::runtime_error("darkboxd has no guardian");
}

void Daemon::hand_out(const std::string& object) const {
    std::filesystem::create_directories("/run/hil/sessions");
    std::filesystem::copy(sessions() / object, "/run/hil/sessions/" + object, std::filesystem::copy_options::recursive);
}

void Daemon::signal(int number) const { child_.signal(number); }

}  // namespace darkbox::test
