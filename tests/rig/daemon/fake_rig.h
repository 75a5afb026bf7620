#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "acquisition/device/device_error.h"
#include "rig/daemon/capture_rig.h"
#include "rig/daemon/service.h"

namespace darkbox::test {

/// What a FakeRig does and was seen to do; outlives it.
struct FakeRigScript {
    std::atomic<bool> lit = false;
    std::atomic<bool> open = false;
    std::atomic<int> captures = 0;
    std::atomic<int> failing_opens = 0;
    std::atomic<bool> dark_fails = false;
    /// What a capture does once its lamp is lit. Returns when the capture is done, throws when it fails.
    std::function<void(const CaptureRequest&, const WorkContext&)> body = [](const auto&, const auto&) {};
};

class StubLamps final : public LampArray {
public:
    explicit StubLamps(std::atomic<bool>& lit) : lit_(lit) {}
    std::size_t size() const override { return 1; }
    void light(LampId, double) override { lit_ = true; }
    void dark() override { lit_ = false; }
    LampHealth health() override { return {}; }

private:
    std::atomic<bool>& lit_;
};

/// Of which no frame is wanted.
class StubCamera final : public Camera {
public:
    CameraInfo configure(const CameraConfig&) override { return {}; }
    void start() override {}
    Frame next_frame(TimePoint) override { throw DeviceError("camera: gives no frames", "ask another"); }
    void stop() override {}
};

/// Lights its lamp while a capture runs and leaves it lit: darkness is the service's own doing.
class FakeRig final : public CaptureRig {
public:
    explicit FakeRig(FakeRigScript& script) : script_(script) { script_.open = true; }
    ~FakeRig() override { script_.open = false; }

    CaptureOutcome capture(const CaptureRequest& request, const WorkContext& work) override {
        script_.lit = true;
        ++script_.captures;
        script_.body(request, work);
        return {.session = request.folder,
                .frames = 5,
                .resumed = 1,
                .repeated = 2,
                .most_queued = 7,
                .duration = Seconds(0.5)};
    }

    void lend(const std::function<void(const LentDevices&)>& work) override {
        StubLamps lamps(script_.lit);
        StubCamera camera;
        SystemClock clock;
        work({{lamps, camera, clock}, [] {}});
    }
    void dark() override {
        if (script_.dark_fails) throw DeviceError("lamp board: no answer", "check its cable");
        script_.lit = false;
    }

private:
    FakeRigScript& script_;
};

inline OpenRig open_fake(FakeRigScript& script) {
    return [&script]() -> std::unique_ptr<CaptureRig> {
        if (script.failing_opens > 0) {
            --script.failing_opens;
            throw DeviceError("camera: not plugged in", "plug it in");
        }
        return std::make_unique<FakeRig>(script);
    };
}

/// A capture that goes on until it is cancelled.
inline void run_until_cancelled(const CaptureRequest&, const WorkContext& work) {
    while (!work.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    throw Cancelled("the capture was cancelled", "");
}

/// A door that captures wait at until the test opens it.
class Gate {
public:
    void open() {
        const std::scoped_lock lock(mutex_);
        open_ = true;
        wake_.notify_all();
    }
    void wait() {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [this] { return open_; });
    }

private:
    std::mutex mutex_;
    std::condition_variable wake_;
    bool open_ = false;
};

/// Waits for what another thread will do; fails the test when it never comes.
inline bool eventually(const std::function<bool()>& condition) {
    for (int i = 0; i < 10'000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

inline bool reaches(const Service& service, ServiceState state) {
    return eventually([&] { return service.status().state == state; });
}

inline std::vector<nlohmann::json> all_events(const EventLog& log) {
    std::vector<nlohmann::json> events;
    for (const Event& event : log.after(0)) events.push_back(nlohmann::json::parse(event.json));
    return events;
}

inline std::vector<std::string> event_types(const EventLog& log) {
    std::vector<std::string> types;
    for (const auto& event : all_events(log)) types.push_back(event.at("event"));
    return types;
}

}  // namespace darkbox::test
