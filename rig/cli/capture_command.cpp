#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>

#include "acquisition/device/device_error.h"
#include "rig/capture/flat_frames.h"
#include "rig/cli/capture_series.h"
#include "rig/cli/followed_job.h"
#include "rig/cli/object_options.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/capture_order_json.h"
#include "rig/daemon/client.h"
#include "rig/daemon/hardware.h"
#include "rig/daemon/session_folder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using EventJson = DaemonClient::Json;

struct CaptureArguments {
    fs::path rig;
    int simulate = 0;  ///< lamps of the built-in simulated rig; 0 = not asked for
    std::string object;
    ObjectOptions about;
    std::string plan = "all";
    std::string mode;      ///< empty: the rig's own
    std::string exposure;  ///< "auto" or microseconds; empty: the rig's own
    fs::path flats_from;
    fs::path retake;
    fs::path resume;
    fs::path out;
    fs::path socket;
    bool standalone = false;
    int repeat = 1;
    std::string between;  ///< command; empty: none
    int between_timeout_s = 60;
};

FrameKind kind_of(const CaptureArguments& a) { return a.plan == "flat" ? FrameKind::flat : FrameKind::lit; }

/// What a session without a name is called after.
std::string label_of(const CaptureArguments& a) {
    if (!a.object.empty()) return a.object;
    return kind_of(a) == FrameKind::flat ? flat_object : a.retake.filename().string();
}

/// "auto", or microseconds; none for an empty text.
std::optional<ExposureChoice> exposure_of(const std::string& text) {
    if (text.empty()) return std::nullopt;
    if (text == "auto") return ExposureChoice{};
    double us = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), us);
    if (error != std::errc() || end != text.data() + text.size() || !(us >= 1 && us <= 60e6))
        throw InputError(fmt::format("--exposure {} is neither auto nor microseconds", text),
                         "write auto, or 1 to 60000000");
    return ExposureChoice{Seconds(us / 1e6)};
}

CommandResult captured(const std::string& folder, std::size_t frames, int repeated, int resumed, double seconds,
                       const std::vector<std::string>& findings) {
    CommandResult result;
    result.json = {{"session", folder},  {"frames", frames},   {"repeated", repeated},
                   {"resumed", resumed}, {"seconds", seconds}, {"findings", findings}};
    result.warnings = findings;
    result.text =
        fmt::format("{}: {} frames, sealed, in {:.1f} s. Next: darkbox process {}", folder, frames, seconds, folder);
    if (repeated > 0) result.warnings.push_back(fmt::format("{} exposures had to be repeated", repeated));
    return result;
}

// In this process.

/// A session is resumed, or taken again in parts, with the rig it was begun with, unless another is named.
RigDescription rig_for(const CaptureArguments& a, const CaptureRequest& request) {
    if (!a.rig.empty()) return load_rig(a.rig);
    if (a.simulate > 0) return parse_rig(simulated_rig_toml(a.simulate), "built-in simulated rig");
    const fs::path kept = request.folder / "data" / "rig.toml";
    if (request.start == CaptureStart::resume && fs::exists(kept)) return load_rig(kept);
    if (request.retake && fs::exists(*request.retake / "data" / "rig.toml"))
        return load_rig(*request.retake / "data" / "rig.toml");
    throw InputError("no rig is given", "give --rig rig.toml, or --simulate 12 for a simulated rig");
}

CaptureRequest request_for(const CaptureArguments& a) {
    CaptureRequest request{
        .folder = a.out, .object = a.object, .lamps = lamps_of_plan(a.plan), .mode = sync_mode_from_name(a.mode)};
    request.exposure = exposure_of(a.exposure);
    request.record = object_record(a.about);
    const fs::path folder = default_sessions_folder();
    request.kind = kind_of(a);
    const auto found = [&](const fs::path& session) { return fs::exists(session) ? session : folder / session; };
    if (!a.retake.empty()) request.retake = found(a.retake);
    if (!a.flats_from.empty()) request.flats = found(a.flats_from);
    if (!a.resume.empty()) {
        request.start = CaptureStart::resume;
        request.folder = found(a.resume);
    } else if (a.out.empty()) {
        fs::create_directories(folder);
        request.folder = folder / fresh_session_name(folder, label_of(a), std::chrono::system_clock::now());
    }
    return request;
}

/// The remedy, and the command that goes on, where there is an interrupted session to go on with.
std::string way_on(const fs::path& session, const std::string& remedy) {
    std::error_code ignored;
    if (!fs::exists(session / "journal.jsonl", ignored)) return remedy;
    return fmt::format("{}go on with: darkbox capture --standalone --resume {}",
                       remedy.empty() ? "" : remedy + "; then ", session.string());
}

CommandResult capture_here(const CaptureArguments& a, const WorkContext& work) {
    const CaptureRequest request = request_for(a);
    const RigDescription description = rig_for(a, request);
    Hardware hardware(description);
    const auto rig = hardware.open();
    try {
        const CaptureOutcome o = rig->capture(request, work);
        return captured(o.session.string(), o.frames, o.repeated, o.resumed, o.duration.count(), o.findings);
    } catch (const Cancelled& cancelled) {
        rig->dark();  // said below only because this did not throw
        throw Cancelled(std::string(cancelled.what()) + "; the lamps are dark", way_on(request.folder, ""));
    } catch (const DeviceError& error) {
        throw DeviceError(error.what(), way_on(request.folder, error.hint()));
    } catch (const InputError& error) {
        throw InputError(error.what(), way_on(request.folder, error.hint()));
    }
}

// Through the daemon.

/// What to do when darkboxd stops in the midst of it.
std::string resume_after(const EventJson& job) {
    return fmt::format("start it again, then: darkbox capture --resume {}", job.at("session").get<std::string>());
}

CaptureOrder order_for(const CaptureArguments& a, const DaemonClient& client) {
    CaptureOrder order{.object = a.object, .lamps = lamps_of_plan(a.plan), .mode = sync_mode_from_name(a.mode)};
    order.exposure = exposure_of(a.exposure);
    order.record = object_record(a.about);
    order.kind = kind_of(a);
    if (a.out.empty() && a.resume.empty() && a.retake.empty() && a.flats_from.empty()) return order;
    const std::string folder = client.call("GET", "status").at("sessions");
    if (!a.resume.empty()) order.resume = name_in_folder(a.resume, folder);
    if (!a.out.empty()) order.name = name_in_folder(a.out, folder);
    if (!a.retake.empty()) order.retake = name_in_folder(a.retake, folder);
    if (!a.flats_from.empty()) order.flats_from = name_in_folder(a.flats_from, folder);
    return order;
}

[[noreturn]] void throw_end(const EventJson& end) {
    const std::string what = end.at("detail");
    const std::string hint = end.at("hint");
    if (end.at("event") == "cancelled") throw Cancelled(what + "; the lamps are dark", hint);
    throw DeviceError(what, hint);
}

CommandResult capture_through(const DaemonClient& client, const CaptureArguments& a, const WorkContext& work) {
    const EventJson job = client.call("POST", "captures", to_json(order_for(a, client)));
    const EventJson end = FollowedJob(client, job, work, resume_after(job)).end();
    if (end.at("event") == "done")
        return captured(end.at("folder"), end.at("frames"), end.at("repeated"), end.at("resumed"), end.at("seconds"),
                        end.value("findings", std::vector<std::string>()));
    throw_end(end);
}

/// The alarms of a calibration against the last and the first.
std::vector<std::string> alarms_of(const EventJson& session) {
    std::vector<std::string> alarms;
    for (const EventJson& drift : session.at("drift"))
        if (const std::string alarm = drift.at("alarm"); !alarm.empty())
            alarms.push_back(fmt::format("since the {} calibration, {}: {}", drift.at("role").get<std::string>(),
                                         drift.at("against").get<std::string>(), alarm));
    return alarms;
}

/// A capture of the ball and what follows from it: the calibration, compared with earlier ones.
CommandResult recalibrate(const DaemonClient& client, const WorkContext& work) {
    const EventJson job = client.call("POST", "jobs", {{"kind", "recalibrate"}});
    const EventJson captured = FollowedJob(client, job, work, resume_after(job)).end();
    if (captured.at("event") != "done") throw_end(captured);
    const EventJson next = client.call("GET", fmt::format("jobs/{}", captured.at("next").get<std::uint64_t>()));
    const EventJson calibrated = FollowedJob(client, next, work, resume_after(job)).end();
    if (calibrated.at("event") != "done") throw_end(calibrated);
    const std::string session = captured.at("session");
    const EventJson stored = client.call("GET", "sessions/" + session);
    CommandResult result;
    result.json = {{"session", session}, {"frames", captured.at("frames").get<std::size_t>()}};
    result.json["drift"] = Json::parse(stored.at("drift").dump());
    result.warnings = alarms_of(stored);
    result.text = fmt::format("{}: calibrated; {}", session,
                              stored.at("drift").empty() ? "the first of this rig"
                              : result.warnings.empty()  ? "within the thresholds of the last and the first"
                                                         : "see the alarms");
    return result;
}

/// One capture, or as many as were asked for.
template <class Capture>
CommandResult capture_all(const CaptureArguments& a, const fs::path& sessions, Capture capture,
                          const WorkContext& work) {
    if (a.repeat == 1) return capture(a);
    CaptureSeries series{.object = a.object};
    if (!a.between.empty()) series.between = Hook{split_words(a.between), std::chrono::seconds(a.between_timeout_s)};
    // A name made of object and moment goes into the usual folder; the daemon takes names in its own.
    fs::path base = a.out;
    if (base.empty()) base = sessions / fresh_session_name(sessions, label_of(a), std::chrono::system_clock::now());
    const auto into = [&](const fs::path& session) {
        CaptureArguments one = a;
        one.out = session;
        return capture(one);
    };
    return capture_series(series, numbered_names(base, a.repeat), into, work);
}

CommandResult run(const CaptureArguments& a, const WorkContext& work) {
    if (!a.resume.empty() && !(a.out.empty() && a.object.empty() && a.about.empty()))
        throw InputError("a resumed session keeps its name and its object",
                         "leave out --out, --object, --inventory and --meta");
    const bool flat = kind_of(a) == FrameKind::flat;
    if (!a.resume.empty() && !(a.retake.empty() && a.exposure.empty() && a.flats_from.empty() && !flat))
        throw InputError("a resumed session keeps its plan and its exposure",
                         "leave out --retake, --exposure, --flats-from and --plan flat");
    if (!a.retake.empty() && !(a.exposure.empty() && a.flats_from.empty() && !flat))
        throw InputError("a re-take keeps its session's exposure and flat frames",
                         "leave out --exposure, --flats-from and --plan flat");
    if (flat && !a.flats_from.empty())
        throw InputError("flat frames are taken, and taken over, at once", "leave out --flats-from or --plan flat");
    if (a.plan == "recalibrate" && (!a.retake.empty() || !a.exposure.empty() || a.standalone || !a.resume.empty() ||
                                    !a.out.empty() || !a.flats_from.empty()))
        throw InputError("--plan recalibrate is darkboxd's to do, as a whole", "leave out the other options");
    if (a.repeat == 1 && !a.between.empty())
        throw InputError("--between runs between captures, and there is one", "give --repeat N");
    if (a.repeat > 1 && (!a.resume.empty() || !a.retake.empty() || a.plan == "recalibrate"))
        throw InputError("--repeat makes new sessions", "leave out --resume, --retake and --plan recalibrate");
    if (a.standalone)
        return capture_all(
            a, default_sessions_folder(), [&](const CaptureArguments& one) { return capture_here(one, work); }, work);
    const DaemonClient client(a.socket.empty() ? default_socket() : a.socket);
    if (!client.answers())
        throw InputError(fmt::format("no darkboxd answers at {}", client.socket().string()),
                         "start it (darkboxd --config rig.toml), or capture in this process with --standalone");
    if (!a.rig.empty() || a.simulate > 0)
        throw InputError("darkboxd has its rig already", "leave out --rig and --simulate, or add --standalone");
    if (a.plan == "recalibrate") return recalibrate(client, work);
    const fs::path folder = client.call("GET", "status").at("sessions").get<std::string>();
    return capture_all(
        a, folder, [&](const CaptureArguments& one) { return capture_through(client, one, work); }, work);
}

}  // namespace

std::vector<std::string> lamps_of_plan(const std::string& plan) {
    std::vector<std::string> lamps;
    if (plan == "all" || plan == "flat") return lamps;
    std::istringstream names(plan);
    for (std::string name; std::getline(names >> std::ws, name, ',');) {
        while (name.ends_with(' ')) name.pop_back();
        if (name.empty())
            throw InputError(fmt::format("--plan \"{}\" holds an empty name", plan), "write lamp-01,lamp-02 or all");
        lamps.push_back(name);
    }
    if (lamps.empty()) throw InputError("--plan names no lamp", "write lamp-01,lamp-02 or all");
    return lamps;
}

std::string name_in_folder(const fs::path& session, const fs::path& folder) {
    const fs::path plain = session.has_filename() ? session : session.parent_path();
    if (!plain.has_parent_path() || fs::weakly_canonical(plain.parent_path()) == fs::weakly_canonical(folder))
        return plain.filename().string();
    throw InputError(fmt::format("{} is not in darkboxd's folder {}", session.string(), folder.string()),
                     "give the session's name alone, or capture with --standalone");
}

void add_capture_command(CommandLine& line) {
    const auto a = std::make_shared<CaptureArguments>();
    CLI::App& command =
        line.add("capture", "Capture an object lamp by lamp, through darkboxd or in this process",
                 "darkbox capture --object vase --inventory 1907.12 --meta title=\"A vase\" --meta creator=\"A "
                 "potter\"\n  darkbox capture --out vase --repeat 24 --between \"./turn.sh 15\"\n  "
                 "darkbox capture --plan flat --out card && darkbox capture --object vase --flats-from card\n  "
                 "darkbox capture --retake vase --lamps lamp-03 --out vase-2\n  "
                 "darkbox capture --standalone --rig rig.toml --out vase",
                 [a](const WorkContext& work) { return run(*a, work); });
    auto* rig = command.add_option("--rig", a->rig, "The rig's description, with --standalone");
    command.add_option("--simulate", a->simulate, "A simulated rig of this many lamps, with --standalone")
        ->check(CLI::Range(3, 64))
        ->excludes(rig);
    command.add_option("--object", a->object, "Name of the object");
    add_object_options(command, a->about);
    command.add_option("--plan,--lamps", a->plan,
                       "all, names of lamps between commas, recalibrate, or flat: frames of a grey or white card in "
                       "the object's place, which tell how bright each lamp is");
    command.add_option("--flats-from", a->flats_from,
                       "Take the flat frames of this sealed session along; calibration reads the lamps' intensities "
                       "off them");
    command.add_option(
        "--exposure", a->exposure,
        "auto: metered, so that the object reaches 80 to 90 % of full scale; or microseconds; default: the "
        "rig's");
    command.add_option("--retake", a->retake,
                       "Take --lamps of this sealed session again, into a new one that takes the rest over");
    command
        .add_option("--mode", a->mode, "How fast: settled, predictive or strobed; default: the rig's [capture] mode")
        ->check(CLI::IsMember({"settled", "predictive", "strobed"}));
    command.add_option("--resume", a->resume, "Go on with this interrupted session");
    command.add_option("--out", a->out, "The new session; default: made of object and date");
    command.add_option("--repeat", a->repeat, "Captures one after the other, into sessions with numbers: OUT-001, ...")
        ->check(CLI::Range(1, 10000));
    command.add_option("--between", a->between,
                       "A command to run between them, such as one that turns a table; without a shell. It finds "
                       "DARKBOX_SESSION, _NEXT, _CAPTURED, _REPEAT and _OBJECT in its environment");
    command.add_option("--between-timeout", a->between_timeout_s, "Seconds that it may take")
        ->check(CLI::Range(1, 86400))
        ->capture_default_str();
    command.add_flag("--standalone", a->standalone, "Drive the rig in this process, without darkboxd");
    command.add_option("--socket", a->socket, "Where darkboxd listens");
}

}  // namespace darkbox
