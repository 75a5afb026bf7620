#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/camera/camera.h"
#include "sim/faults.h"
#include "sim/lamp_pictures.h"
#include "sim/lamp_witness.h"
#include "sim/quick_sensor.h"
#include "sim/sensor.h"
#include "sim/sim_clock.h"

namespace darkbox::sim {

struct SimCameraOptions {
    Sensor sensor;
    SensorColour colour = SensorColour::rgb;
    bool quick_noise = false;  ///< by QuickSensor
    int latency_frames = 1;    ///< exposures after start() that still have the controls from before configure()
    int queue_depth = 2;       ///< finished frames that wait; while the queue is full new ones are lost
    Seconds shortest_period{1.0 / 30};
    Seconds shortest_exposure{20e-6};
    Seconds longest_exposure{60};
    Seconds readout{0.004};  ///< from the end of the exposure to the finished frame
    double room_light = 0;   ///< this share of every lamp's light is always there
    FaultPlan faults;
};

/// Which lamps really lit a delivered picture, and how much.
struct ExposureTruth {
    std::uint64_t sequence = 0;
    TimePoint timestamp;
    std::vector<LampShare> lamps;
};

/// A free-running camera with a global shutter and a strobe line to the lamps that sees the scene in the light that the
/// lamps really gave during each exposure. Timestamps are the start of the exposure; sequences go on counting over
/// stop() and start(). Refers to scene, lamps and clock; others may have the pictures, too, of the same scene and of
/// the options' colour, or of rgb where the faults move or blur what is seen. Configuring again is allowed while not
/// streaming.
/// Thread-compatible.
class SimCamera final : public Camera {
public:
    SimCamera(const Scene& scene, std::shared_ptr<LampPictures> pictures, LampWitness& lamps, SimClock& clock,
              SimCameraOptions options);
    ~SimCamera() override;

    CameraInfo configure(const CameraConfig& config) override;
    void start() override;
    Frame next_frame(TimePoint deadline) override;
    void stop() override;

    /// One entry for each frame delivered.
    const std::vector<ExposureTruth>& exposures() const { return exposures_; }

private:
    enum class State { closed, ready, streaming };
    /// A picture that was, or is being, exposed.
    struct Exposure {
        std::uint64_t sequence = 0;
        FrameControls controls;
        Interval interval;
    };

    Exposure exposure(std::uint64_t sequence) const;
    Exposure earlier(const Exposure& e, std::uint64_t frames) const;
    TimePoint finished(const Exposure& e) const { return e.interval.end + to_nanoseconds(options_.readout); }
    void strobe_until_now();
    void fill_queue();
    void wait_for_frame(TimePoint deadline);
    bool hangs();
    Frame deliver(const Exposure& e);
    void fail_while_unplugged();
    std::uint64_t counted(std::uint64_t sequence) const;
    RgbImage seen(RgbImage light, std::uint64_t sequence) const;
    std::vector<LightShare> lights_of(const std::vector<LampShare>& burning);
    std::vector<float> sum_of(const std::vector<LightShare>& lights) const;
    std::vector<std::uint16_t> samples_of(const Exposure& picture, const std::vector<LampShare>& burning,
                                          const Sensor& sensor);

    const Scene& scene_;
    std::shared_ptr<LampPictures> pictures_;
    LampWitness& lamps_;
    SimClock& clock_;
    SimCameraOptions options_;
    std::optional<QuickSensor> quick_;
    State state_ = State::closed;
    FrameControls controls_;         ///< asked for
    FrameControls controls_before_;  ///< in effect for the first frames after start()
    Nanoseconds period_{0};
    TimePoint stream_start_;
    std::optional<TimePoint> first_start_;  ///< when it began to get warm
    std::uint64_t first_sequence_ = 0;      ///< of this stream
    std::uint64_t next_sequence_ = 0;       ///< to be exposed
    std::uint64_t next_strobe_ = 0;         ///< the frame whose end of exposure is not told yet
    std::deque<Exposure> queue_;
    std::vector<std::uint64_t>
        waits_hung_;  ///< for each fault of the plan; of an unplugged camera: calls that failed, and starts
    std::vector<ExposureTruth> exposures_;
};

}  // namespace darkbox::sim
