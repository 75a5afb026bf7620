#include <fmt/format.h>

#include <chrono>

#include <memory>

#include "acquisition/frame/error.h"
#include "rig/cli/doctor.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/client.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

struct DoctorArguments {
    fs::path rig = "/etc/darkbox/rig.toml";
    fs::path sessions;
};

const char* word(Verdict verdict) {
    switch (verdict) {
        case Verdict::good:
            return "good";
        case Verdict::warning:
            return "look";
        case Verdict::bad:
            break;
    }
    return "BAD";
}

Diagnosis diagnose_daemon() {
    const auto socket = known_socket();
    if (socket && DaemonClient(*socket).answers()) {
        // systemd holds the socket: that somebody listens does not mean that darkboxd gets up.
        try {
            const auto status = DaemonClient(*socket, std::chrono::seconds(5)).call("GET", "status");
            const std::string state = status.at("state");
            if (state == "Idle" || state == "Busy")
                return {"darkboxd", Verdict::good, fmt::format("answers at {}: {}", socket->string(), state)};
            return {"darkboxd", Verdict::warning,
                    fmt::format("is {}: {}", state, status.value("problem", std::string("it opens the rig"))),
                    state == "Fault" ? "look at the lamps, then: darkbox lamps dark"
                                     : "put right what it says; it tries again by itself"};
        } catch (const Error& error) {
            return {"darkboxd", Verdict::bad, error.what(),
                    "journalctl -u darkboxd says why it does not start; then sudo systemctl restart darkboxd.socket "
                    "darkboxd"};
        }
    }
    return {"darkboxd", Verdict::warning, "does not answer",
            "sudo systemctl start darkboxd (journalctl -u darkboxd says why it ended), or darkboxd --config rig.toml"};
}

Diagnoses diagnose(const DoctorArguments& a) {
    Diagnoses all;
    const auto take = [&all](Diagnoses more) { all.insert(all.end(), more.begin(), more.end()); };
    try {
        const RigDescription rig = load_rig(a.rig);
        all.push_back(
            {"rig", Verdict::good, fmt::format("{}: {}, {} lamps", a.rig.string(), rig.name, rig.lamps.size())});
        const MachineSeen machine = look_at_machine(rig);
        take(diagnose_camera(rig, machine));
        take(diagnose_camera_bus(rig, machine));
        take(diagnose_lamps(rig, machine));
        take(diagnose_usb_power(machine));
        const fs::path sessions = !a.sessions.empty()            ? a.sessions
                                  : !rig.sessions_folder.empty() ? rig.sessions_folder
                                                                 : default_sessions_folder();
        take(diagnose_disk(rig, sessions));
    } catch (const Error& error) {
        all.push_back({"rig", Verdict::bad, error.what(), error.hint()});
    }
    all.push_back(diagnose_daemon());
    return all;
}

CommandResult doctor(const DoctorArguments& a) {
    CommandResult result;
    result.json["checks"] = Json::array();
    std::size_t bad = 0;
    for (const Diagnosis& d : diagnose(a)) {
        result.json["checks"].push_back(
            {{"subject", d.subject}, {"verdict", word(d.verdict)}, {"found", d.found}, {"remedy", d.remedy}});
        result.text += fmt::format("{:<5} {}: {}\n", word(d.verdict), d.subject, d.found);
        if (!d.remedy.empty()) result.text += fmt::format("      → {}\n", d.remedy);
        bad += d.verdict == Verdict::bad ? 1 : 0;
    }
    result.json["bad"] = bad;
    result.text.pop_back();
    if (bad > 0)
        result.warnings.push_back(fmt::format("{} must be put right before this rig can capture",
                                              bad == 1 ? "one thing" : fmt::format("{} things", bad)));
    return result;
}

}  // namespace

void add_doctor_command(CommandLine& line) {
    const auto a = std::make_shared<DoctorArguments>();
    CLI::App& command = line.add("doctor", "Check this machine for what a rig needs, and say what to do",
                                 "darkbox doctor --rig rig.toml", [a](const WorkContext&) { return doctor(*a); });
    command.add_option("--rig", a->rig, "The rig's description")->capture_default_str();
    command.add_option("--sessions", a->sessions, "Where sessions are to lie; else as rig.toml says");
}

}  // namespace darkbox
