#include "rig/daemon/hardware.h"

#include <fmt/format.h>

#include <chrono>

#include "acquisition/frame/error.h"
#include "sim/sim_rig.h"

namespace darkbox {
namespace {

using Stopwatch = std::chrono::steady_clock;

class SimulatedRig final : public CaptureRig {
public:
    explicit SimulatedRig(const RigDescription& rig) : rig_(rig), sim_(sim::SimRig::make(rig)) {}

    CaptureOutcome capture(const CaptureRequest& request, const WorkContext& work) override {
        const auto start = Stopwatch::now();
        const auto [session, summary] = capture_session(request, rig_, sim_.lamps(), sim_.camera(), sim_.clock(), work);
        sim_.write_truth(session.folder() / "truth");
        return {.session = session.folder(),
                .frames = session.frames().size(),
                .resumed = summary.resumed,
                .repeated = summary.repeated,
                .duration = Stopwatch::now() - start};
    }

    void dark() override { sim_.lamps().dark(); }

private:
    RigDescription rig_;
    sim::SimRig sim_;
};

void need_simulator(const std::string& what, const std::string& driver) {
    if (driver == "sim") return;
    throw InputError(fmt::format("this build has no {} driver \"{}\" yet", what, driver),
                     fmt::format("use driver = \"sim\" under [{}]", what));
}

}  // namespace

std::unique_ptr<CaptureRig> open_hardware(const RigDescription& rig) {
    need_simulator("camera", rig.camera.driver);
    need_simulator("lamps", rig.lamps_driver);
    return std::make_unique<SimulatedRig>(rig);
}

}  // namespace darkbox
