#include "rig/capture/capture_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "acquisition/device/device_error.h"
#include "acquisition/session/frame_file.h"
#include "rig/capture/frame_source.h"
#include "rig/capture/picture_check.h"

namespace darkbox {
namespace {

std::int64_t nanoseconds(TimePoint moment) { return moment.time_since_epoch().count(); }

/// Frames of one switch of the lamps.
struct Exposure {
    std::vector<Frame> frames;  ///< all exposed in the steady interval; the first is the shot
    TimePoint on;               ///< the lamp was confirmed lit (or dark, for a dark shot)
    TimePoint off;              ///< the lamp was told to go dark
};

/// A closing dark frame that differed leaves the frames before it in doubt for good.
void refuse_doubtful(const SessionWriter& writer) {
    for (const FrameRecord& record : writer.acknowledged())
        if (!record.verified)
            throw InputError(fmt::format("session {} cannot be resumed: frame {} failed: {}", writer.folder().string(),
                                         record.file, record.verification),
                             "its frames may be lit by more than their lamp: capture a new session");
}

void validate(const CapturePlan& plan, const RigDescription& rig, const LampArray& lamps) {
    if (lamps.size() != rig.lamps.size())
        throw InputError(
            fmt::format("the rig describes {} lamps, but its driver has {}", rig.lamps.size(), lamps.size()),
            "correct [[lamps.lamp]] of rig.toml");
    if (plan.shots.empty()) throw InputError("the capture plan has no shots", "plan at least one lamp");
    if (plan.shots.front().kind != FrameKind::dark)
        throw InputError(fmt::format("the capture plan begins with {}", plan.shots.front().name),
                         "begin with a dark frame: every other frame is compared with it");
    for (const Shot& shot : plan.shots) {
        const bool lit = shot.kind == FrameKind::lit;
        if ((!lit && shot.kind != FrameKind::dark) || lit != shot.lamp.has_value())
            throw InputError(fmt::format("shot {} is neither dark nor of one lamp", shot.name),
                             "plan lit shots with a lamp and dark shots without");
        if (lit && shot.lamp->value >= rig.lamps.size())
            throw InputError(fmt::format("shot {} wants lamp {}; allowed: 0 to {}", shot.name, shot.lamp->value,
                                         rig.lamps.size() - 1),
                             "plan lamps that the rig has");
        if (shot.camera.exposure != plan.shots.front().camera.exposure ||
            shot.camera.gain != plan.shots.front().camera.gain)
            throw InputError(fmt::format("shot {} has an exposure or gain of its own", shot.name),
                             "one dark frame serves one exposure and gain: plan a session for each");
    }
}

/// One run of a plan; see run_capture(). The lamps go dark before the camera stops: a camera may hang while it does.
class Run {
public:
    Run(const CapturePlan& plan, const RigDescription& rig, LampArray& lamps, Camera& camera, Clock& clock,
        SessionWriter& writer, const WorkContext& work)
        : plan_(plan),
          rig_(rig),
          lamps_(lamps),
          clock_(clock),
          writer_(writer),
          work_(work),
          source_(camera, clock, plan.shots.front().camera, work),
          dark_on_exit_(lamps),
          check_(source_.info(), rig.capture) {}

    CaptureSummary all() {
        for (const Shot& shot : plan_.shots) {
            if (is_acknowledged(shot)) {
                ++summary_.resumed;
                continue;
            }
            tell(shot.lamp ? lamp(shot).name : "dark");
            if (!check_.has_dark() && summary_.resumed > 0) compare_with_interrupted_run(shot.camera);
            keep(shot);
        }
        lamps_.dark();
        tell("");
        return summary_;
    }

private:
    const LampDescription& lamp(const Shot& shot) const { return rig_.lamps.at(shot.lamp->value); }

    void tell(const std::string& detail) const {
        work_.tell(
            {"capture", static_cast<std::size_t>(summary_.taken + summary_.resumed), plan_.shots.size(), detail});
    }

    bool is_acknowledged(const Shot& shot) const {
        const auto& records = writer_.acknowledged();
        return std::any_of(records.begin(), records.end(), [&](const FrameRecord& record) {
            return std::filesystem::path(record.file).stem() == shot.name && record.kind == shot.kind &&
                   record.lamp == shot.lamp;
        });
    }

    /// The dark frame of the interrupted run goes on being the reference. One more is taken and looked at, not kept: it
    /// shows a lamp that got stuck or a door that was opened in the meantime.
    void compare_with_interrupted_run(const CameraConfig& config) {
        for (const FrameRecord& record : writer_.acknowledged()) {
            if (record.kind != FrameKind::dark) continue;
            const Frame dark = read_frame(writer_.folder() / "data" / record.file, record);
            check_same_camera(dark);
            check_.accept_dark(dark);
            break;
        }
        take(Shot{FrameKind::dark, std::nullopt, config, "dark frame for comparison"});
    }

    void check_same_camera(const Frame& stored) const {
        const CameraInfo& camera = source_.info();
        if (stored.width == camera.width && stored.height == camera.height && stored.format == camera.format &&
            stored.bit_depth == camera.bit_depth)
            return;
        throw InputError(fmt::format("the session holds frames of {}x{} {} of {} bits, but the camera now delivers "
                                     "{}x{} {} of {} bits",
                                     stored.width, stored.height, name(stored.format), stored.bit_depth, camera.width,
                                     camera.height, name(camera.format), camera.bit_depth),
                         "connect the camera that the session was begun with, or capture a new session");
    }

    /// What a shot's checks came to.
    struct Verdict {
        bool verified = true;
        std::string words;
    };

    void keep(const Shot& shot) {
        try {
            add(shot, {true, take(shot)});
        } catch (const DarkDiffers& error) {
            add(shot, {false, error.what()});
            if (plan_.closing_dark_differs_is_error) throw;
        }
    }

    void add(const Shot& shot, const Verdict& verdict) {
        writer_.add(exposed_.frames.front(), record_of(shot, verdict));
        ++summary_.taken;
    }

    FrameRecord record_of(const Shot& shot, const Verdict& verdict) const {
        const Frame& frame = exposed_.frames.front();
        FrameRecord record;
        record.file = "frames/" + shot.name + ".tif";
        record.kind = shot.kind;
        record.lamp = shot.lamp;
        record.exposure_s = frame.controls.exposure.count();
        record.gain = frame.controls.gain;
        record.sequence = frame.sequence;
        record.timestamp_ns = nanoseconds(frame.timestamp);
        if (shot.lamp) {
            record.lamp_name = lamp(shot).name;
            record.lamp_on_ns = nanoseconds(exposed_.on);
            record.lamp_off_ns = nanoseconds(exposed_.off);
        }
        record.verified = verdict.verified;
        record.verification = verdict.words;
        return record;
    }

    /// Tries until a frame passes every check, at most rig.capture.tries times. The frame is in exposed_; what was
    /// found comes back in words.
    std::string take(const Shot& shot) {
        for (int number = 1;; ++number) {
            try {
                return take_once(shot);
            } catch (const DeviceError& error) {
                reject(shot, number, error);
            } catch (const DarkDiffers& error) {
                reject(shot, number, error);
                distrust_timestamps();
            } catch (const InputError& error) {
                reject(shot, number, error);
                distrust_timestamps();
            }
        }
    }

    /// A picture contradicted its timestamps: from here on the run waits longer after every switch, but never longer
    /// than the camera can hold pictures back.
    void distrust_timestamps() {
        constexpr int spare_frames = 4;
        const auto held_back =
            frame_time() * (source_.info().queue_depth + source_.info().latency_frames + spare_frames);
        margin_ = std::min<Nanoseconds>(2 * margin_ + frame_time(), held_back);
    }

    std::string take_once(const Shot& shot) {
        source_.recover(to_nanoseconds(rig_.capture.frame_deadline));
        exposed_ = expose(shot);
        const std::string found = shot.lamp
                                      ? check_.accept_lit(lamp(shot).name, exposed_.frames.at(0), exposed_.frames.at(1))
                                      : check_.accept_dark(exposed_.frames.front());
        const double after = to_seconds(exposed_.frames.front().exposure.begin - exposed_.on);
        return fmt::format("exposed {:.1f} ms after the switch, within the steady time; {}", after * 1000.0, found);
    }

    template <typename Kind>
    void reject(const Shot& shot, int number, const Kind& error) {
        ++summary_.repeated;
        lamps_.dark();
        writer_.note_event(fmt::format("{}: try {} of {}: {}", shot.name, number, rig_.capture.tries, error.what()));
        if (number < rig_.capture.tries) return;
        const std::string who = shot.lamp ? fmt::format("lamp '{}', frame {}", lamp(shot).name, shot.name)
                                          : fmt::format("all lamps dark, frame {}", shot.name);
        throw Kind(fmt::format("{}: no good frame in {} tries; the last time {}", who, number, error.what()),
                   error.hint());
    }

    Exposure expose(const Shot& shot) {
        const std::size_t wanted = shot.lamp ? 2 : 1;  // the second confirms the first
        stop_when_asked(work_);
        Exposure exposure;
        if (shot.lamp)
            lamps_.light(*shot.lamp, 1.0);
        else
            lamps_.dark();
        exposure.on = clock_.now();
        const TimePoint steady = exposure.on + settle(shot) + margin_;
        const TimePoint deadline = deadline_of(shot, exposure.on, steady);
        try {
            while (exposure.frames.size() < wanted) exposure.frames.push_back(source_.first_after(steady, deadline));
        } catch (const DeadlineError&) {
            refuse_overlong(shot, exposure.on);
            throw;
        }
        exposure.off = clock_.now();
        lamps_.dark();
        last_lamp_ = shot.lamp;
        note_lost(shot);
        return exposure;
    }

    /// The lamp before this one must have faded, too.
    Nanoseconds settle(const Shot& shot) const {
        const auto settle_of = [&](std::optional<LampId> id) {
            return id ? rig_.lamps.at(id->value).settle : Seconds(0);
        };
        return to_nanoseconds(std::max(settle_of(shot.lamp), settle_of(last_lamp_)));
    }

    Nanoseconds frame_time() const {
        return to_nanoseconds(std::max(source_.info().frame_period, source_.info().controls.exposure));
    }

    /// A camera that works needs the queued frames and two more; one that hangs is given frame_deadline besides. A
    /// lamp is never left on for longer than it bears.
    TimePoint deadline_of(const Shot& shot, TimePoint on, TimePoint steady) const {
        const TimePoint patience =
            steady + frame_time() * (source_.info().queue_depth + 4) + to_nanoseconds(rig_.capture.frame_deadline);
        return shot.lamp ? std::min(patience, on + to_nanoseconds(lamp(shot).max_on)) : patience;
    }

    void refuse_overlong(const Shot& shot, TimePoint on) const {
        if (!shot.lamp || clock_.now() < on + to_nanoseconds(lamp(shot).max_on)) return;
        throw DeadlineError(fmt::format("no frame came within the lamp's max_on_s of {} s", lamp(shot).max_on.count()),
                            "check the camera, or raise max_on_s of the lamp if it bears that");
    }

    void note_lost(const Shot& shot) {
        const std::uint64_t lost = source_.take_lost();
        if (lost > 0) writer_.note_event(fmt::format("{}: the camera lost {} frames before this one", shot.name, lost));
    }

    const CapturePlan& plan_;
    const RigDescription& rig_;
    LampArray& lamps_;
    Clock& clock_;
    SessionWriter& writer_;
    const WorkContext& work_;
    FrameSource source_;
    DarkOnExit dark_on_exit_;
    PictureCheck check_;
    Exposure exposed_;  ///< of the latest try
    CaptureSummary summary_;
    std::optional<LampId> last_lamp_;
    Nanoseconds margin_{0};  ///< waited besides the settle time, since pictures came later than their timestamps
};

}  // namespace

CaptureSummary run_capture(const CapturePlan& plan, const RigDescription& rig, LampArray& lamps, Camera& camera,
                           Clock& clock, SessionWriter& writer, const WorkContext& work) {
    validate(plan, rig, lamps);
    if (plan.closing_dark_differs_is_error) refuse_doubtful(writer);
    lamps.dark();
    return Run(plan, rig, lamps, camera, clock, writer, work).all();
}

}  // namespace darkbox
