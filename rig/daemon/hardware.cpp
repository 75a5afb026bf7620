#include "rig/daemon/hardware.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "acquisition/camera/v4l2_camera.h"
#include "acquisition/device/device_error.h"
#include "acquisition/frame/error.h"
#include "acquisition/session/disk_fault.h"
#include "rig/capture/interlock.h"
#include "rig/capture/timing_store.h"
#include "rig/daemon/readiness.h"
#include "rig/health/frame_review.h"
#include "rig/lamps/gpio_lamps.h"
#include "rig/lamps/usb_lamps.h"
#include "sim/sim_rig.h"

namespace darkbox {
namespace {

using Stopwatch = std::chrono::steady_clock;

V4l2Options v4l2_options(const CameraDescription& camera) {
    V4l2Options options;
    options.device = camera.device;
    options.format = camera.format;
    options.width = camera.width;
    options.height = camera.height;
    options.frame_rate = camera.frame_rate;
    options.crop = camera.crop;
    return options;
}

std::optional<MeasuredTiming> measured(const CameraInfo& camera) {
    return stored_timing(default_timing_file(), camera);
}

/// Lets work drive the lamps and the camera, behind the door's switch where there is one.
void drive(const CaptureDevices& devices, Door* door, const std::function<void(const LentDevices&)>& work) {
    if (door == nullptr) return work({devices, [] {}});
    InterlockedLamps lamps(devices.lamps, *door);
    InterlockedCamera camera(devices.camera, lamps);
    work({{lamps, camera, devices.clock}, [&lamps] { lamps.watch(); }});
}

CaptureOutcome capture_with(const CaptureDevices& devices, Door* door, CaptureRequest request,
                            const RigDescription& rig, Readiness& readiness, const WorkContext& work) {
    const auto start = Stopwatch::now();
    CaptureOutcome outcome;
    drive(devices, door, [&](const LentDevices& d) {
        readiness.require(rig, d, request, work);
        CaptureRequest reviewed = request;
        reviewed.review = [&rig](const SessionWriter& frames) { return review_frames(frames, rig); };
        const auto [session, summary, findings] =
            capture_session(reviewed, rig, d.lamps, d.camera, d.clock, work, measured);
        outcome = {.session = session.folder(),
                   .frames = session.frames().size(),
                   .resumed = summary.resumed,
                   .repeated = summary.repeated,
                   .most_queued = summary.most_queued,
                   .findings = findings};
        readiness.used(d.clock.now());
    });
    outcome.duration = Stopwatch::now() - start;
    return outcome;
}

/// Its camera sees simulated lamps, or those of an emulated board, which are driven as real ones.
class SimulatedRig final : public CaptureRig {
public:
    SimulatedRig(const RigDescription& rig, std::unique_ptr<LampArray> driven)
        : rig_(rig), sim_(sim::SimRig::make(rig)), driven_(std::move(driven)) {}

    CaptureOutcome capture(const CaptureRequest& request, const WorkContext& work) override {
        sim_ = sim::SimRig::make_again(sim_);  // its truth is of this capture alone, and its camera is cold
        std::optional<FailingDisk> failing;
        if (sim_.disk().has_faults())
            failing.emplace(request.folder, [&disk = sim_.disk()] { return disk.next_write(); });
        Readiness readiness(rig_.health);
        const CaptureOutcome outcome =
            capture_with({lamps(), sim_.camera(), sim_.clock()}, door(), request, rig_, readiness, work);
        write_truth(outcome.session);
        return outcome;
    }

    void lend(const std::function<void(const LentDevices&)>& work) override {
        const DarkOnExit dark_on_exit(lamps());
        drive({lamps(), sim_.camera(), sim_.clock()}, door(), work);
    }

    void dark() override { lamps().dark(); }
    LampHealth health() override { return lamps().health(); }

private:
    Door* door() { return rig_.door ? &sim_.door() : nullptr; }
    LampArray& lamps() { return driven_ ? *driven_ : static_cast<LampArray&>(sim_.lamps()); }

    /// All of it or nothing: the session is sealed by now and complete without it.
    void write_truth(const std::filesystem::path& session) const {
        const auto partial = session / "truth.partial";
        try {
            sim_.write_truth(partial);
            std::filesystem::remove_all(session / "truth");
            std::filesystem::rename(partial, session / "truth");
        } catch (const std::exception& error) {
            std::error_code ignored;
            std::filesystem::remove_all(partial, ignored);
            throw DeviceError(fmt::format("the session {} is sealed and complete, but the simulator's truth beside it "
                                          "could not be written: {}",
                                          session.string(), error.what()),
                              "free space on that disk and capture again if you need the truth");
        }
    }

    RigDescription rig_;
    sim::SimRig sim_;
    std::unique_ptr<LampArray> driven_;
};

/// Real devices; the lamps go first when it ends, so that a camera that hangs leaves them dark.
class RealRig final : public CaptureRig {
public:
    RealRig(const RigDescription& rig, std::unique_ptr<LampArray> lamps, std::unique_ptr<Door> door)
        : rig_(rig),
          camera_(device_, clock_, v4l2_options(rig.camera)),
          door_(std::move(door)),
          lamps_(std::move(lamps)) {}

    CaptureOutcome capture(const CaptureRequest& request, const WorkContext& work) override {
        return capture_with({*lamps_, camera_, clock_}, door_.get(), request, rig_, readiness_, work);
    }

    void lend(const std::function<void(const LentDevices&)>& work) override {
        const DarkOnExit dark_on_exit(*lamps_);
        drive({*lamps_, camera_, clock_}, door_.get(), work);
    }

    void dark() override { lamps_->dark(); }
    LampHealth health() override { return lamps_->health(); }

private:
    RigDescription rig_;
    Readiness readiness_{rig_.health};
    SystemClock clock_;
    KernelVideoDevice device_;
    V4l2Camera camera_;
    std::unique_ptr<Door> door_;
    std::unique_ptr<LampArray> lamps_;
};

}  // namespace

Hardware::Hardware(const RigDescription& rig) : rig_(rig) {
    if (rig_.lamps_driver != "gpio") return;
    if (auto guardian = connect_guardian(guardian_socket()))
        guardian_.emplace(gpio_request(rig_), request_gpio_lines, std::move(*guardian));
    else
        guardian_.emplace(gpio_request(rig_), request_gpio_lines);
}

std::unique_ptr<LampArray> Hardware::open_lamps() {
    if (guardian_) return std::make_unique<GpioLamps>(rig_, *guardian_);
    if (rig_.lamps_driver == "sim")
        throw InputError("simulated lamps shine in a simulated capture alone", "darkbox capture --simulate 12");
    return std::make_unique<UsbLamps>(rig_);
}

std::unique_ptr<Door> Hardware::open_door() const {
    if (!rig_.door || rig_.camera.driver == "sim") return nullptr;
    return std::make_unique<GpioDoor>(*rig_.door, request_gpio_input);
}

std::unique_ptr<CaptureRig> Hardware::open() {
    if (rig_.camera.driver == "sim")
        return std::make_unique<SimulatedRig>(rig_, rig_.lamps_driver == "sim" ? nullptr : open_lamps());
    return std::make_unique<RealRig>(rig_, open_lamps(), open_door());
}

CameraInfo check_camera(const RigDescription& rig) {
    const CameraConfig config{rig.camera.exposure, rig.camera.gain};
    if (rig.camera.driver == "sim") return sim::SimRig::make(rig).camera().configure(config);
    SystemClock clock;
    KernelVideoDevice device;
    return V4l2Camera(device, clock, v4l2_options(rig.camera)).configure(config);
}

}  // namespace darkbox
