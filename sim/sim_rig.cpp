#include "sim/sim_rig.h"

#include <fmt/format.h>

#include <utility>

#include "acquisition/frame/error.h"
#include "sim/scenes.h"
#include "sim/truth.h"

namespace darkbox::sim {
namespace {

void require(bool holds, std::string_view field, double value, std::string_view range) {
    if (!holds) throw InputError(fmt::format("sim.{} is {}, but must be {}", field, value, range), "correct rig.toml");
}

void validate(const SimDescription& sim) {
    require(sim.width >= 16 && sim.width <= 8192, "width", sim.width, "16 to 8192 pixels");
    require(sim.height >= 16 && sim.height <= 8192, "height", sim.height, "16 to 8192 pixels");
    require(sim.bit_depth >= 8 && sim.bit_depth <= 16, "bit_depth", sim.bit_depth, "8 to 16");
    require(sim.full_well_e >= 100, "full_well_e", sim.full_well_e, "at least 100 electrons");
    require(sim.read_noise_e >= 0, "read_noise_e", sim.read_noise_e, "0 or more electrons");
    require(sim.latency_frames >= 0, "latency_frames", sim.latency_frames, "0 or more");
    require(sim.queue_depth >= 1, "queue_depth", sim.queue_depth, "1 or more");
}

}  // namespace

Sensor sensor_of(const SimDescription& sim) {
    Sensor sensor;
    sensor.bit_depth = sim.bit_depth;
    sensor.black_level = static_cast<double>(1 << sim.bit_depth) / 64.0;
    sensor.full_well_e = sim.full_well_e;
    sensor.read_noise_e = sim.read_noise_e;
    sensor.seed = sim.seed;
    return sensor;
}

SimRig SimRig::make(const RigDescription& rig, const FaultPlan& more_faults) {
    validate(rig.sim);
    SimRig scene;
    scene.description_ = std::make_shared<const RigDescription>(rig);
    scene.faults_ = parse_faults(rig.sim.faults);
    scene.faults_.faults.insert(scene.faults_.faults.end(), more_faults.faults.begin(), more_faults.faults.end());
    scene.scene_ =
        std::make_shared<const Scene>(scene_by_name(rig.sim, rig.lamps, rig.ball_diameter_mm.value_or(36.0)));
    const SensorColour colour = sensor_colour_from_name(rig.sim.colour);
    scene.pictures_ =
        std::make_shared<LampPictures>(scene.scene_, changes_what_is_seen(scene.faults_) ? SensorColour::rgb : colour);
    return make_again(scene);
}

SimRig SimRig::make_again(const SimRig& other) {
    const RigDescription& rig = *other.description_;
    SimRig result;
    result.description_ = other.description_;
    result.faults_ = other.faults_;
    result.scene_ = other.scene_;
    result.pictures_ = other.pictures_;
    result.clock_ =
        std::make_unique<SimClock>(rig.sim.real_time ? SimClock::Pace::real_time : SimClock::Pace::virtual_time);
    result.lamps_ = std::make_unique<SimLamps>(rig.lamps.size(), *result.clock_, result.faults_);
    SimCameraOptions options;
    options.sensor = sensor_of(rig.sim);
    options.colour = sensor_colour_from_name(rig.sim.colour);
    options.quick_noise = rig.sim.quick_noise;
    options.latency_frames = rig.sim.latency_frames;
    options.queue_depth = rig.sim.queue_depth;
    options.room_light = rig.sim.room_light;
    options.faults = result.faults_;
    if (!rig.sim.lamps_seen.empty()) result.seen_ = std::make_unique<SeenLamps>(rig);
    LampWitness& witness = result.seen_ ? static_cast<LampWitness&>(*result.seen_) : *result.lamps_;
    result.camera_ = std::make_unique<SimCamera>(*result.scene_, result.pictures_, witness, *result.clock_, options);
    result.door_ = std::make_unique<SimDoor>(*result.camera_, result.faults_);
    return result;
}

SimRig& SimRig::operator=(SimRig&& other) noexcept {
    camera_.reset();  // first: it holds on to the lamps it strobes, and to all else
    description_ = std::move(other.description_);
    faults_ = std::move(other.faults_);
    scene_ = std::move(other.scene_);
    pictures_ = std::move(other.pictures_);
    clock_ = std::move(other.clock_);
    lamps_ = std::move(other.lamps_);
    seen_ = std::move(other.seen_);
    camera_ = std::move(other.camera_);
    door_ = std::move(other.door_);
    return *this;
}

void SimRig::write_truth(const std::filesystem::path& folder) const {
    sim::write_truth(*scene_, camera_->exposures(), folder);
}

}  // namespace darkbox::sim
