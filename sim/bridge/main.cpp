#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "acquisition/frame/error.h"
#include "sim/bridge/lamp_lines.h"
#include "sim/bridge/lamp_record.h"
#include "sim/bridge/twin_camera.h"
#include "sim/scenes.h"
#include "sim/sim_rig.h"
#include "sim/truth.h"

namespace darkbox::sim {
namespace {

namespace fs = std::filesystem;

struct Arguments {
    fs::path rig;
    fs::path pictures;
    fs::path truth;
    fs::path lines;
    fs::path seen;
    fs::path strobe;
    std::vector<std::size_t> cut;
    std::vector<std::size_t> swap;
    double unplugged_s = 3.0;
    double period_s = 0.5;
};

TwinOrders orders;

void on_signal(int number) {
    if (number == SIGUSR1)
        orders.damage_next = true;
    else if (number == SIGUSR2)
        orders.unplug = true;
    else
        orders.leave = true;
}

void render(const Arguments& a) {
    const RigDescription rig = load_rig(a.rig);
    const Scene scene = scene_by_name(rig.sim, rig.lamps, rig.ball_diameter_mm.value_or(36.0));
    TwinPictures(scene).write(a.pictures);
    if (!a.truth.empty()) write_truth(scene, {}, a.truth);
}

std::unique_ptr<LampView> lamps_of(const Arguments& a, RigDescription rig, const Clock& clock) {
    if (!a.seen.empty()) {
        rig.sim.lamps_seen = a.seen;
        return std::make_unique<LampRecord>(rig, clock);
    }
    WiringFault fault{.cut = a.cut, .swapped = {}};
    if (a.swap.size() == 2) fault.swapped.emplace_back(a.swap[0], a.swap[1]);
    return std::make_unique<LampLines>(a.lines, rig.lamps.size(), fault);
}

void run(const Arguments& a) {
    const RigDescription rig = load_rig(a.rig);
    const TwinPictures pictures(a.pictures);
    if (pictures.lamps() != rig.lamps.size())
        throw InputError(fmt::format("{} holds pictures of {} lamps, {} describes {}", a.pictures.string(),
                                     pictures.lamps(), a.rig.string(), rig.lamps.size()),
                         "make it anew with twin_camera render");
    SystemClock clock;
    const std::unique_ptr<LampView> lamps = lamps_of(a, rig, clock);
    std::optional<SharedLine> strobe;
    if (!a.strobe.empty()) strobe.emplace(a.strobe);
    const TwinOptions options{.mode = {pictures.width(), pictures.height(), Seconds(a.period_s)},
                              .sensor = sensor_of(rig.sim),
                              .port = 0,
                              .unplugged = Seconds(a.unplugged_s),
                              .strobe = strobe ? &*strobe : nullptr};
    for (const int number : {SIGINT, SIGTERM, SIGUSR1, SIGUSR2}) std::signal(number, on_signal);
    TwinCamera(pictures, *lamps, clock, options, orders).run();
}

int parse_and_run(int argc, char** argv) {
    Arguments a;
    CLI::App app(
        "The digital twin as a USB camera that the kernel's own driver drives, lit by the lines of a gpio-sim chip or "
        "by "
        "an emulated lamp controller",
        "twin_camera");
    app.require_subcommand(1);
    CLI::App& rendering = *app.add_subcommand("render", "Render what the camera will see, ahead");
    CLI::App& running = *app.add_subcommand(
        "run", "Plug the camera in. SIGUSR1: the next frame is damaged; SIGUSR2: unplug, and plug in again");
    for (CLI::App* command : {&rendering, &running}) {
        command->add_option("--rig", a.rig, "The rig's description; [sim] names the scene")->required();
        command->add_option("--pictures", a.pictures, "File of what was rendered")->required();
    }
    rendering.add_option("--truth", a.truth, "Folder for what is true of the scene");
    CLI::Option_group& lamps = *running.add_option_group("Lamps");
    lamps.add_option("--lines", a.lines, "Folder of the gpio-sim chip in sysfs");
    lamps.add_option("--seen", a.seen, "File to which an emulated lamp controller writes what burns");
    lamps.require_option(1);
    running.add_option("--strobe", a.strobe, "File that is the strobe line, for an emulated lamp controller");
    running.add_option("--cut", a.cut, "Lamps, from 0, whose wires are cut");
    running.add_option("--swap", a.swap, "Two lamps, from 0, whose wires are exchanged")->expected(2);
    running.add_option("--unplugged", a.unplugged_s, "How long an unplugged camera stays away, s");
    running.add_option("--period", a.period_s, "Of its frames, s");
    CLI11_PARSE(app, argc, argv);
    rendering.parsed() ? render(a) : run(a);
    return 0;
}

}  // namespace
}  // namespace darkbox::sim

int main(int argc, char** argv) {
    try {
        return darkbox::sim::parse_and_run(argc, argv);
    } catch (const darkbox::Error& error) {
        fmt::print(stderr, "twin_camera: error: {}\n  {}\n", error.what(), error.hint());
    } catch (const std::exception& error) {
        fmt::print(stderr, "twin_camera: error: {}\n", error.what());
    }
    return 1;
}
