#include "rig/description/sim_section.h"

#include <cstdint>
#include <limits>

namespace darkbox {

bool is_word_of_scene(const std::string& scene, const std::string& word) {
    return ("-" + scene + "-").find("-" + word + "-") != std::string::npos;
}

SimDescription read_sim(TomlSection& section) {
    SimDescription sim;
    section.allow({"scene", "width", "height", "colour", "bit_depth", "full_well_e", "read_noise_e", "latency_frames",
                   "queue_depth", "seed", "room_light", "real_time", "quick_noise", "faults", "lamps_seen",
                   "strobe_line"});
    const auto whole = [&](const char* key, Allowed<std::int64_t> allowed, int fallback) {
        return static_cast<int>(section.integer(key, allowed).value_or(fallback));
    };
    if (section.has("scene")) sim.scene = section.required_text("scene");
    sim.width = whole("width", {16, 8192}, sim.width);
    sim.height = whole("height", {16, 8192}, sim.height);
    sim.colour = section.choice("colour", sim.colour, {"rgb", "grey", "rggb"});
    sim.bit_depth = whole("bit_depth", {8, 16}, sim.bit_depth);
    sim.full_well_e = section.number("full_well_e", {100, 10'000'000}).value_or(sim.full_well_e);
    sim.read_noise_e = section.number("read_noise_e", {0, 1000}).value_or(sim.read_noise_e);
    sim.latency_frames = whole("latency_frames", {0, 16}, sim.latency_frames);
    sim.queue_depth = whole("queue_depth", {1, 32}, sim.queue_depth);
    sim.room_light = section.number("room_light", {0, 1}).value_or(sim.room_light);
    const auto any_seed = Allowed<std::int64_t>{0, std::numeric_limits<std::int64_t>::max()};
    sim.seed =
        static_cast<std::uint64_t>(section.integer("seed", any_seed).value_or(static_cast<std::int64_t>(sim.seed)));
    sim.real_time = section.flag("real_time").value_or(sim.real_time);
    sim.quick_noise = section.flag("quick_noise").value_or(sim.quick_noise);
    sim.faults = section.text("faults").value_or("");
    sim.lamps_seen = section.text("lamps_seen").value_or("");
    sim.strobe_line = section.text("strobe_line").value_or("");
    if (!sim.strobe_line.empty() && sim.lamps_seen.empty())
        section.fail("strobe_line", "has strobe_line without lamps_seen",
                     "remove it: simulated lamps hear the camera's strobe line without a file");
    if (!sim.lamps_seen.empty() && !sim.real_time)
        section.fail("lamps_seen", "has lamps_seen without real_time",
                     "add real_time = true: real lamps know no virtual time");
    return sim;
}

void settle_simulated_camera(RigDescription& rig) {
    if (rig.camera.driver != "sim") return;
    rig.sim.camera_distance_mm = rig.camera.distance_mm.value_or(rig.sim.camera_distance_mm);
    if (is_word_of_scene(rig.sim.scene, "perspective")) rig.camera.distance_mm = rig.sim.camera_distance_mm;
}

}  // namespace darkbox
