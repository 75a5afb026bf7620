#include "rig/health/warm_up.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <opencv2/core.hpp>

#include "acquisition/frame/error.h"
#include "rig/health/luminance.h"

namespace darkbox {
namespace {

constexpr Seconds every{1};
constexpr int longest_frames = 16;  ///< periods that one frame may take, beside the rig's own deadline
constexpr double minute_s = 60;

/// The dark level at a moment.
struct DarkLevel {
    double at_s = 0;
    double level = 0;
};

/// A line through them, by least squares, with what its scatter says of the slope.
struct Slope {
    double per_s = 0;
    double sigma = 0;
};

Slope slope_of(const std::deque<DarkLevel>& levels) {
    double mean_t = 0, mean_y = 0;
    const auto n = static_cast<double>(levels.size());
    for (const DarkLevel& l : levels) {
        mean_t += l.at_s / n;
        mean_y += l.level / n;
    }
    double tt = 0, ty = 0, rest = 0;
    for (const DarkLevel& l : levels) {
        tt += (l.at_s - mean_t) * (l.at_s - mean_t);
        ty += (l.at_s - mean_t) * (l.level - mean_y);
    }
    const double slope = ty / tt;
    for (const DarkLevel& l : levels) {
        const double off = l.level - mean_y - slope * (l.at_s - mean_t);
        rest += off * off;
    }
    return {slope, std::sqrt(rest / (n - 2) / tt)};
}

double length_of(const std::deque<DarkLevel>& levels) { return levels.back().at_s - levels.front().at_s; }

}  // namespace

std::string WarmUp::words() const {
    return fmt::format("the camera's dark level changes by {:.2g} of full scale a minute, after {:.0f} s", per_minute,
                       watched.count());
}

void WarmUpOptions::validate() const {
    const auto require = [](bool good, const char* field, double value, const char* allowed) {
        if (!good) throw InputError(fmt::format("{} is {}; allowed: {}", field, value, allowed), "correct it");
    };
    require(steady_level > 0 && steady_level <= 0.1, "steady_level", steady_level, "above 0, up to 0.1");
    require(window >= Seconds(3) && window <= Seconds(600), "window", window.count(), "3 to 600 s");
    require(longest >= window, "longest", longest.count(), "the window or longer");
}

WarmUp watch_warm_up(const RigDescription& rig, const CaptureDevices& devices, const WarmUpOptions& options,
                     const WorkContext& work) {
    options.validate();
    devices.lamps.dark();
    FrameSource source(devices.camera, devices.clock, CameraConfig{rig.camera.exposure, rig.camera.gain}, work);
    const Nanoseconds patience =
        longest_frames * to_nanoseconds(source.info().frame_period) + to_nanoseconds(rig.capture.frame_deadline);
    const TimePoint begin = devices.clock.now();
    std::deque<DarkLevel> levels;
    WarmUp found;
    while (true) {
        stop_when_asked(work);
        const TimePoint now = devices.clock.now();
        const Frame frame = source.first_after(now, now + patience);
        found.watched = Seconds(to_seconds(frame.exposure.begin - begin));
        levels.push_back({found.watched.count(), cv::mean(luminance_of(frame).light)[0]});
        while (levels.size() > 3 && levels.back().at_s - levels[1].at_s >= options.window.count()) levels.pop_front();
        const bool whole = length_of(levels) >= options.window.count();
        if (whole) {
            const Slope slope = slope_of(levels);
            found.per_minute = slope.per_s * minute_s;
            found.sigma = slope.sigma * minute_s;
            found.steady = std::abs(found.per_minute) + 2 * found.sigma <= options.steady_level;
            if (found.steady || found.watched >= options.longest) return found;
        }
        work.tell({"warming up", static_cast<std::size_t>(std::min(found.watched, options.longest).count()),
                   static_cast<std::size_t>(options.longest.count()), whole ? found.words() : ""});
        devices.clock.sleep_until(now + to_nanoseconds(every));
    }
}

}  // namespace darkbox
