#include <fmt/format.h>

#include <memory>

#include "acquisition/frame/error.h"
#include "rig/capture/timing_store.h"
#include "rig/cli/rig_commands.h"
#include "rig/daemon/hardware.h"

namespace darkbox {
namespace {

struct LatencyArguments {
    std::filesystem::path rig;
    int simulate = 0;
    std::string lamp;  ///< empty: the first
    int flips = LatencyOptions().flips;
    std::filesystem::path state;
};

LampId lamp_named(const RigDescription& rig, const std::string& name) {
    if (name.empty()) return LampId{0};
    for (std::uint32_t id = 0; id < rig.lamps.size(); ++id)
        if (rig.lamps[id].name == name) return LampId{id};
    throw InputError(fmt::format("the rig has no lamp '{}'", name), "darkbox lamps list shows its lamps");
}

std::string sentence(const LatencyReport& r) {
    return fmt::format(
        "{} exposes its first row from {:+.3f} ms beside the timestamp on (the driver says {:+.3f}), its last row "
        "until "
        "{:+.3f} ms; read-out {:.3f} ms, exposure {:.3f} ms (set to {:.3f}); sure to {:.3f} ms, from {} readings",
        r.camera.model, to_milliseconds(r.timing.begin_from_stamp), 1000 * r.told_begin.count(),
        to_milliseconds(r.timing.end_from_stamp), to_milliseconds(r.timing.readout), 1000 * r.exposure.count(),
        1000 * r.camera.controls.exposure.count(), to_milliseconds(r.timing.margin), r.readings);
}

CommandResult run(const LatencyArguments& a, const WorkContext& work) {
    if (a.rig.empty() && a.simulate == 0) throw InputError("no rig is given", "give --rig rig.toml, or --simulate 12");
    const RigDescription rig =
        a.rig.empty() ? parse_rig(simulated_rig_toml(a.simulate), "built-in simulated rig") : load_rig(a.rig);
    LatencyOptions options;
    options.lamp = lamp_named(rig, a.lamp);
    options.flips = a.flips;
    const std::filesystem::path file = a.state.empty() ? default_timing_file() : a.state;
    Hardware hardware(rig);
    LatencyReport report;
    hardware.open()->lend(
        [&](const CaptureDevices& devices) { report = measure_latency(rig, devices, options, work); });
    store_timing(file, report);

    CommandResult result;
    result.json = {{"camera", report.camera.model},
                   {"driver", report.camera.driver},
                   {"begin_from_stamp_ms", to_milliseconds(report.timing.begin_from_stamp)},
                   {"end_from_stamp_ms", to_milliseconds(report.timing.end_from_stamp)},
                   {"told_begin_from_stamp_ms", 1000 * report.told_begin.count()},
                   {"readout_ms", to_milliseconds(report.timing.readout)},
                   {"exposure_ms", 1000 * report.exposure.count()},
                   {"margin_ms", to_milliseconds(report.timing.margin)},
                   {"readings", report.readings},
                   {"file", file.string()}};
    result.text = sentence(report) + "\nkept in " + file.string() + " for captures with this camera, mode and exposure";
    const double off = std::abs(report.exposure / report.camera.controls.exposure - 1);
    if (off > 0.05)
        result.warnings.push_back(
            fmt::format("the exposure is {:.3f} ms, not {:.3f}: the camera does not keep what it "
                        "was set to",
                        1000 * report.exposure.count(), 1000 * report.camera.controls.exposure.count()));
    return result;
}

}  // namespace

void add_measure_latency_command(CommandLine& line, CLI::App& rig) {
    const auto a = std::make_shared<LatencyArguments>();
    CLI::App& command = line.add(
        "measure-latency", "Measure when frames are really exposed, by flipping a lamp",
        "darkbox rig measure-latency --rig rig.toml --lamp lamp-01",
        [a](const WorkContext& work) { return run(*a, work); }, &rig);
    auto* file = command.add_option("--rig", a->rig, "The rig's description");
    command.add_option("--simulate", a->simulate, "A simulated rig of this many lamps")
        ->check(CLI::Range(3, 64))
        ->excludes(file);
    command.add_option("--lamp", a->lamp, "The lamp to flip; default: the first");
    command.add_option("--flips", a->flips, "How often")->check(CLI::Range(4, 1000));
    command.add_option("--state", a->state, "Where to keep the result; default: the file that captures look into");
}

}  // namespace darkbox
