#include "rig/capture/capture_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "acquisition/device/device_error.h"
#include "rig/capture/predictive_shots.h"
#include "rig/capture/settled_shots.h"
#include "rig/capture/strobed_shots.h"

namespace darkbox {
namespace {

/// A room that fills more of the sensor than this leaves the lamps too little, and its noise drowns theirs.
constexpr double most_ambient = 0.5;

/// The shots of one exposure after the other.
std::vector<std::span<const Shot>> parts_of(const CapturePlan& plan) {
    const auto other = [](const Shot& a, const Shot& b) {
        return a.camera.exposure != b.camera.exposure || a.camera.gain != b.camera.gain;
    };
    std::vector<std::span<const Shot>> parts;
    for (auto begin = plan.shots.begin(); begin != plan.shots.end();) {
        auto end = std::adjacent_find(begin, plan.shots.end(), other);
        if (end != plan.shots.end()) ++end;
        parts.emplace_back(begin, end);
        begin = end;
    }
    return parts;
}

std::int64_t nanoseconds(TimePoint moment) { return moment.time_since_epoch().count(); }

/// Sessions of before frames were withdrawn hold those of which nobody knows what lit them.
void refuse_doubtful(const FrameSink& sink) {
    for (const FrameRecord& record : sink.kept())
        if (!record.verified)
            throw InputError(
                fmt::format("the session cannot be resumed: frame {} failed: {}", record.file, record.verification),
                "its frames may be lit by more than their lamp: capture a new session");
}

void validate(const CapturePlan& plan, const RigDescription& rig, const LampArray& lamps) {
    if (lamps.size() != rig.lamps.size())
        throw InputError(
            fmt::format("the rig describes {} lamps, but its driver has {}", rig.lamps.size(), lamps.size()),
            "correct [[lamps.lamp]] of rig.toml");
    if (plan.shots.empty()) throw InputError("the capture plan has no shots", "plan at least one lamp");
    for (const Shot& shot : plan.shots) {
        const bool lit = shot.kind == FrameKind::lit || shot.kind == FrameKind::flat;
        const bool unlit = shot.kind == FrameKind::dark || shot.kind == FrameKind::ambient;
        if ((!lit && !unlit) || lit != shot.lamp.has_value())
            throw InputError(fmt::format("shot {} is neither dark nor of one lamp", shot.name),
                             "plan lit shots with a lamp and dark shots without");
        if (lit && shot.lamp->value >= rig.lamps.size())
            throw InputError(fmt::format("shot {} wants lamp {}; allowed: 0 to {}", shot.name, shot.lamp->value,
                                         rig.lamps.size() - 1),
                             "plan lamps that the rig has");
    }
    if (plan.shots.front().lamp)
        throw InputError(fmt::format("the capture plan begins with {}", plan.shots.front().name),
                         "begin with a dark frame: every other frame is compared with it");
    for (const std::span<const Shot> part : parts_of(plan))
        if (part.front().lamp)
            throw InputError(fmt::format("shot {} has an exposure or gain of its own, and no dark frame before it",
                                         part.front().name),
                             "begin every exposure with a dark frame: all others are compared with it");
}

CaptureDescription limits_of(const RigDescription& rig) {
    CaptureDescription limits = rig.capture;
    if (limits.ambient) limits.max_dark = most_ambient;
    return limits;
}

/// The part of a plan that is of one exposure; see run_capture(). The lamps go dark before the camera stops: a camera
/// may hang while it does.
class Run {
public:
    Run(std::span<const Shot> shots, const CapturePlan& plan, const RigDescription& rig, const CaptureDevices& devices,
        FrameSink& sink, const WorkContext& work, const TimingLookup& timings, CaptureSummary& summary)
        : shots_(shots),
          plan_(plan),
          rig_(rig),
          clock_(devices.clock),
          sink_(sink),
          work_(work),
          source_(devices.camera, devices.clock, shots.front().camera, work, timings),
          lamps_(devices.lamps, devices.clock, rig),
          check_(source_.info(), limits_of(rig)),
          settled_(rig, lamps_, source_, check_, devices.clock),
          summary_(summary) {}

    void all() {
        for (auto shot = shots_.begin(); shot != shots_.end();) {
            const auto ahead = stretch_from(shot);
            if (ahead.size() > 1) {
                take_ahead(ahead);
                shot += static_cast<std::ptrdiff_t>(ahead.size());
                continue;
            }
            if (is_kept(*shot)) {
                ++summary_.resumed;
                resumed_ = true;
            } else {
                prepare(*shot);
                dark_differed_ = false;
                TakenShot taken = take_or_withdraw(*shot);
                if (dark_differed_ && withdraw_before(*shot)) {
                    shot = after_last_dark(*shot);
                    continue;
                }
                add(*shot, std::move(taken));
            }
            ++shot;
        }
        lamps_.dark();
    }

private:
    const LampDescription& lamp(const Shot& shot) const { return rig_.lamps.at(shot.lamp->value); }

    void tell(const std::string& detail) const {
        work_.tell(
            {"capture", static_cast<std::size_t>(summary_.taken + summary_.resumed), plan_.shots.size(), detail});
    }

    bool is_kept(const Shot& shot) const {
        const auto& records = sink_.kept();
        return !withdrawn_.contains(file_of(shot)) &&
               std::any_of(records.begin(), records.end(), [&](const FrameRecord& record) {
                   return record.file == file_of(shot) && record.kind == shot.kind && record.lamp == shot.lamp;
               });
    }

    /// The lit shots from here on that can be taken without a stop; none in settled mode.
    std::span<const Shot> stretch_from(std::span<const Shot>::iterator shot) const {
        if (mode_ == SyncMode::settled) return {};
        auto end = std::find_if(shot, shots_.end(), [&](const Shot& s) { return !s.lamp || is_kept(s); });
        // One lamp twice in a row makes no switch to hear a witness of.
        const auto twice = std::adjacent_find(shot, end, [](const Shot& a, const Shot& b) { return a.lamp == b.lamp; });
        if (twice != end) end = twice + 1;
        return {shot, end};
    }

    void prepare(const Shot& shot) {
        tell(shot.lamp ? lamp(shot).name : "dark");
        if (!check_.has_dark() && resumed_) compare_with_interrupted_run(shot.camera);
        wait_for_room();
    }

    /// A disk that does not keep up is waited for in the dark; the sink says when it was too long.
    void wait_for_room() {
        if (sink_.has_room()) return;
        lamps_.dark();
    }

    void take_ahead(std::span<const Shot> shots) {
        prepare(shots.front());
        const Unproven left = take_without_stops(shots);
        for (const std::string& reason : left.reasons)
            sink_.note_event(fmt::format("{} mode: {}", name(mode_), reason));
        if (left.stay_settled) mode_ = SyncMode::settled;
        for (const Shot& shot : left.shots) {
            if (!left.stay_settled) ++summary_.repeated;
            prepare(shot);
            add(shot, take(shot));
        }
    }

    /// The first shot since the last frame without a lamp before this one.
    std::span<const Shot>::iterator after_last_dark(const Shot& shot) const {
        auto first = shots_.begin() + (&shot - shots_.data());
        while (first != shots_.begin() && (first - 1)->lamp) --first;
        return first;
    }

    /// Gives up all frames since the last good frame without a lamp: nobody knows when the light came in. False: there
    /// are none, as before the first one.
    bool withdraw_before(const Shot& dark) {
        std::vector<std::string> names;
        for (auto shot = after_last_dark(dark); &*shot != &dark; ++shot) {
            if (!taken_.contains(file_of(*shot)) && !is_kept(*shot)) continue;
            sink_.withdraw(file_of(*shot), fmt::format("{} differed after it", dark.name));
            taken_.erase(file_of(*shot)) > 0 ? --summary_.taken : --summary_.resumed;
            withdrawn_.insert(file_of(*shot));
            ++summary_.repeated;
            names.push_back(lamp(*shot).name);
        }
        if (names.empty()) return false;
        sink_.note_event(
            fmt::format("{}: it differed from the first one, so that the {} frames before it are in doubt "
                        "and taken again: {}",
                        dark.name, names.size(), fmt::join(names, ", ")));
        if (++withdrawals_ >= rig_.capture.tries)
            throw DarkDiffers(
                fmt::format("frame {}: light came into the box {} times while lamps were lit", dark.name, withdrawals_),
                "look for a door that does not close and for a lamp with a loose contact; what is in "
                "doubt was withdrawn, and is taken again when the session is resumed");
        return true;
    }

    /// When a frame without a lamp goes on differing, those before it are not left in the session.
    TakenShot take_or_withdraw(const Shot& shot) {
        try {
            return take(shot);
        } catch (const DarkDiffers& error) {
            if (withdraw_before(shot))
                throw DarkDiffers(error.what(), error.hint() +
                                                    "; the frames in doubt were withdrawn, and are taken "
                                                    "again when the session is resumed");
            throw;
        }
    }

    Unproven take_without_stops(std::span<const Shot> shots) {
        source_.recover(to_nanoseconds(rig_.capture.frame_deadline));
        const ShotSink proven = [&](const Shot& shot, TakenShot taken) {
            wait_for_room();
            tell(lamp(shot).name);
            add(shot, std::move(taken));
        };
        Unproven left = mode_ == SyncMode::strobed
                            ? StrobedShots(rig_, lamps_, source_, check_, clock_).take(shots, proven)
                            : PredictiveShots(rig_, lamps_, source_, check_, clock_).take(shots, proven);
        note_lost(shots.front());
        return left;
    }

    /// The dark frame of the interrupted run goes on being the reference. One more is taken and looked at, not kept: it
    /// shows a lamp that got stuck or a door that was opened in the meantime.
    void compare_with_interrupted_run(const CameraConfig& config) {
        for (const FrameRecord& record : sink_.kept()) {
            if (record.file != file_of(shots_.front())) continue;
            const Frame dark = sink_.read(record);
            check_same_camera(dark);
            check_.accept_dark(dark);
            break;
        }
        take(Shot{shots_.front().kind, std::nullopt, config, "dark frame for comparison"});
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

    void add(const Shot& shot, TakenShot taken) {
        FrameRecord record = record_of(shot, taken);
        record.verified = true;
        taken_.insert(record.file);
        sink_.add(std::move(taken.frame), std::move(record));
        ++summary_.taken;
    }

    FrameRecord record_of(const Shot& shot, const TakenShot& taken) const {
        const Frame& frame = taken.frame;
        FrameRecord record;
        record.file = file_of(shot);
        record.kind = shot.kind;
        record.lamp = shot.lamp;
        record.exposure_s = frame.controls.exposure.count();
        record.gain = frame.controls.gain;
        record.sequence = frame.sequence;
        record.timestamp_ns = nanoseconds(frame.timestamp);
        if (shot.lamp) {
            record.lamp_name = lamp(shot).name;
            record.lamp_on_ns = nanoseconds(taken.on);
            record.lamp_off_ns = nanoseconds(taken.off);
        }
        record.verification = taken.words;
        if (const auto& noise = check_.noise()) record.noise = {noise->floor, noise->slope};
        return record;
    }

    /// Tries until a frame passes every check, at most rig.capture.tries times.
    TakenShot take(const Shot& shot) {
        for (int number = 1;; ++number) {
            try {
                source_.recover(to_nanoseconds(rig_.capture.frame_deadline));
                TakenShot taken = settled_.take(shot);
                note_lost(shot);
                return taken;
            } catch (const DeviceError& error) {
                reject(shot, number, error);
            } catch (const DarkDiffers& error) {
                dark_differed_ = dark_differed_ || !error.late();
                reject(shot, number, error);
                settled_.distrust_timestamps();
            } catch (const InputError& error) {
                reject(shot, number, error);
                settled_.distrust_timestamps();
            }
        }
    }

    template <typename Kind>
    void reject(const Shot& shot, int number, const Kind& error) {
        ++summary_.repeated;
        lamps_.dark();
        sink_.note_event(fmt::format("{}: try {} of {}: {}", shot.name, number, rig_.capture.tries, error.what()));
        if (number < rig_.capture.tries) return;
        const std::string who = shot.lamp ? fmt::format("lamp '{}', frame {}", lamp(shot).name, shot.name)
                                          : fmt::format("all lamps dark, frame {}", shot.name);
        throw Kind(fmt::format("{}: no good frame in {} tries; the last time {}", who, number, error.what()),
                   error.hint());
    }

    void note_lost(const Shot& shot) {
        const std::uint64_t lost = source_.take_lost();
        if (lost > 0) sink_.note_event(fmt::format("{}: the camera lost {} frames before this one", shot.name, lost));
    }

    const std::span<const Shot> shots_;
    const CapturePlan& plan_;
    const RigDescription& rig_;
    Clock& clock_;
    FrameSink& sink_;
    const WorkContext& work_;
    FrameSource source_;
    TimedLamps lamps_;
    PictureCheck check_;
    SettledShots settled_;
    SyncMode mode_ = rig_.capture.mode;  ///< at present
    bool resumed_ = false;               ///< some of these shots were kept by an earlier run
    std::set<std::string> taken_;        ///< files of this run
    std::set<std::string> withdrawn_;    ///< files that an earlier run kept, and this one does not
    bool dark_differed_ = false;         ///< the frame without a lamp that is being taken, for a moment
    int withdrawals_ = 0;
    CaptureSummary& summary_;  ///< of the whole plan
};

}  // namespace

CaptureSummary run_capture(const CapturePlan& plan, const RigDescription& rig, const CaptureDevices& devices,
                           FrameSink& sink, const WorkContext& work, const TimingLookup& timings) {
    validate(plan, rig, devices.lamps);
    refuse_doubtful(sink);
    devices.lamps.dark();
    CaptureSummary summary;
    for (const std::span<const Shot> shots : parts_of(plan))
        Run(shots, plan, rig, devices, sink, work, timings, summary).all();
    work.tell({"capture", static_cast<std::size_t>(summary.taken + summary.resumed), plan.shots.size(), ""});
    return summary;
}

}  // namespace darkbox
