#include "rig/capture/retake.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "acquisition/frame/error.h"
#include "rig/capture/capture_session.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

bool near(double a, double b) { return std::abs(a - b) <= 0.001 * std::max(std::abs(a), std::abs(b)); }

bool same_exposure(const FrameRecord& a, const FrameRecord& b) {
    return near(a.exposure_s, b.exposure_s) && near(a.gain, b.gain);
}

std::string stem_of(const FrameRecord& record) { return fs::path(record.file).stem().string(); }

[[noreturn]] void refuse(const Session& old, const std::string& what) {
    throw InputError(fmt::format("{} cannot be taken again in parts: {}", old.folder().string(), what),
                     "what differs would show between its frames: capture the object anew");
}

auto output_of(const LampDescription& lamp) { return std::tie(lamp.name, lamp.channel, lamp.line, lamp.address); }

void require_same_rig(const Session& old, const RigDescription& rig) {
    if (old.info().source != "capture")
        throw InputError(fmt::format("{} was imported, not captured", old.folder().string()),
                         "take its photographs again with their own camera, and import them");
    if (const auto difference = difference_from(old, rig)) refuse(old, *difference);
}

/// Of the frames that the session is of: of an object, or, where it shows a card alone, flat.
FrameKind lit_kind_of(const Session& old) {
    const bool lit = std::ranges::any_of(old.frames(), [](const auto& f) { return f.kind == FrameKind::lit; });
    return lit ? FrameKind::lit : FrameKind::flat;
}

std::vector<std::string> unverified_lamps(const Session& old) {
    std::vector<std::string> names;
    for (const FrameRecord& record : old.frames())
        if (record.kind == lit_kind_of(old) && !record.verified &&
            std::ranges::find(names, record.lamp_name) == names.end())
            names.push_back(record.lamp_name);
    if (names.empty())
        throw InputError(fmt::format("every frame of {} was verified", old.folder().string()),
                         "name the lamps to take again: --lamps lamp-01,lamp-02");
    return names;
}

std::set<std::string> checked_lamps(const Session& old, const RigDescription& rig, std::vector<std::string> names) {
    if (names.empty()) names = unverified_lamps(old);
    (void)lamps_named(rig, names);
    std::set<std::string> held;
    for (const FrameRecord& record : old.frames())
        if (record.kind == lit_kind_of(old)) held.insert(record.lamp_name);
    for (const std::string& name : names)
        if (!held.contains(name))
            throw InputError(fmt::format("{} has no frame of lamp '{}'", old.folder().string(), name),
                             fmt::format("its lamps are: {}", fmt::join(held, ", ")));
    return {names.begin(), names.end()};
}

/// Names for what is taken besides: "0000_dark-2", with the next number at each further re-take.
class FreshNames {
public:
    explicit FreshNames(const Session& old) {
        for (const FrameRecord& record : old.frames()) taken_.insert(stem_of(record));
    }
    std::string beside(const std::string& stem) {
        const std::string base = stem.substr(0, stem.find('-'));
        for (int take = 2;; ++take)
            if (std::string name = fmt::format("{}-{}", base, take); taken_.insert(name).second) return name;
    }

private:
    std::set<std::string> taken_;
};

}  // namespace

std::optional<std::string> difference_from(const Session& old, const RigDescription& rig) {
    if (old.info().rig != rig.name)
        return fmt::format("it was captured by rig '{}', and this is '{}'", old.info().rig, rig.name);
    if (old.info().geometry != geometry_of(rig))
        return "the rig's lamps, ball or camera stand elsewhere by its description";
    const RigDescription then = load_rig(old.path_of_extra("rig.toml"));
    const bool same = std::ranges::equal(then.lamps, rig.lamps,
                                         [](const auto& a, const auto& b) { return output_of(a) == output_of(b); });
    if (!same || then.lamps_driver != rig.lamps_driver) return "the rig's lamps hang on other outputs";
    const bool ambient = std::ranges::any_of(old.frames(), [](const auto& f) { return f.kind == FrameKind::ambient; });
    if (ambient != rig.capture.ambient) return "it was captured with another `ambient` of [capture]";
    return std::nullopt;
}

std::string identity_of(const CameraInfo& camera) {
    return camera.id.empty() ? camera.model : fmt::format("{} ({})", camera.model, camera.id);
}

Retake plan_retake(const Session& old, const RigDescription& rig, const std::vector<std::string>& lamps) {
    require_same_rig(old, rig);
    const std::set<std::string> wanted = checked_lamps(old, rig, lamps);
    Retake retake{.of = old.reference(), .plan = {}, .taken_over = {}, .files = {}, .order = {}};
    const FrameKind kind = lit_kind_of(old);
    const auto is_retaken = [&](const FrameRecord& record) {
        return record.kind == kind && wanted.contains(record.lamp_name);
    };
    FreshNames names(old);
    const auto add = [&](const FrameRecord& like, const FrameRecord& part, std::string name) {
        Shot shot{like.kind,
                  like.lamp,
                  {Seconds(part.exposure_s), part.gain},
                  std::move(name),
                  fs::path(like.file).extension().string().substr(1)};
        retake.order.push_back(file_of(shot));
        retake.plan.shots.push_back(std::move(shot));
    };
    const std::vector<FrameRecord>& frames = old.frames();
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const FrameRecord& record = frames[i];
        const auto same_part = [&](const FrameRecord& other) { return same_exposure(record, other); };
        const bool first = i == 0 || !same_part(frames[i - 1]),
                   last = i + 1 == frames.size() || !same_part(frames[i + 1]);
        const auto begin = std::find_if_not(std::make_reverse_iterator(frames.begin() + static_cast<std::ptrdiff_t>(i)),
                                            frames.rend(), same_part)
                               .base();
        const auto end = std::find_if_not(frames.begin() + static_cast<std::ptrdiff_t>(i), frames.end(), same_part);
        const bool touched = std::any_of(begin, end, is_retaken);
        if (is_retaken(record)) {
            add(record, *begin, stem_of(record));
        } else if (record.verified) {
            retake.order.push_back(record.file);
            retake.files.push_back(old.path_of(record));
            FrameRecord kept = record;
            if (kept.taken_over_from.empty()) kept.taken_over_from = retake.of.name;
            retake.taken_over.push_back(std::move(kept));
        }
        if (touched && !record.lamp && (first || last)) add(record, *begin, names.beside(stem_of(record)));
    }
    return retake;
}

void require_same_camera(const Session& old, const CameraInfo& camera, const CameraConfig& asked) {
    if (old.info().camera != identity_of(camera))
        refuse(old, fmt::format("it was captured with the camera {}, and this is {}", old.info().camera,
                                identity_of(camera)));
    const FrameRecord& then = old.frames().front();
    if (then.width != camera.width || then.height != camera.height || then.format != name(camera.format) ||
        then.bit_depth != camera.bit_depth || then.black_level != camera.black_level)
        refuse(old,
               fmt::format("its frames are {}x{} {} of {} bits above {}, and the camera now delivers {}x{} {} of {} "
                           "bits above {}",
                           then.width, then.height, then.format, then.bit_depth, then.black_level, camera.width,
                           camera.height, name(camera.format), camera.bit_depth, camera.black_level));
    if (!near(camera.controls.exposure.count(), asked.exposure.count()) || !near(camera.controls.gain, asked.gain))
        refuse(old,
               fmt::format("it was exposed for {} s at gain {}, and the camera now sets {} s at gain {}",
                           asked.exposure.count(), asked.gain, camera.controls.exposure.count(), camera.controls.gain));
}

}  // namespace darkbox
