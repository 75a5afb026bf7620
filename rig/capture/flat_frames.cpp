#include "rig/capture/flat_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "acquisition/frame/error.h"
#include "rig/capture/retake.h"

namespace darkbox {
namespace {

[[noreturn]] void refuse_flats(const Session& flats, const std::string& what) {
    throw InputError(fmt::format("{} has no flat frames for this capture: {}", flats.folder().string(), what),
                     "put a grey or white card in the object's place: darkbox capture --plan flat");
}

bool holds(const Session& flats, LampId lamp) {
    return std::ranges::any_of(flats.frames(), [&](const FrameRecord& f) {
        return f.kind == FrameKind::flat && f.verified && f.lamp == lamp;
    });
}

void require_every_lamp(const std::vector<LampId>& lamps, const Session& flats, const RigDescription& rig) {
    for (const LampId lamp : lamps)
        if (!holds(flats, lamp)) refuse_flats(flats, fmt::format("none of lamp '{}'", rig.lamps.at(lamp.value).name));
}

}  // namespace

void require_camera_of_flats(const Session& flats, const CameraInfo& camera) {
    const FrameRecord& then = flats.frames().front();
    if (flats.info().camera != identity_of(camera))
        refuse_flats(
            flats, fmt::format("they are of the camera {}, and this is {}", flats.info().camera, identity_of(camera)));
    if (then.width != camera.width || then.height != camera.height || then.format != name(camera.format))
        refuse_flats(flats, fmt::format("they are {}x{} {}, and the camera now delivers {}x{} {}", then.width,
                                        then.height, then.format, camera.width, camera.height, name(camera.format)));
}

FlatFrames flats_for(const std::vector<LampId>& lamps, const Session& flats, const RigDescription& rig) {
    if (flats.info().source != "capture") refuse_flats(flats, "it was imported");
    if (const auto difference = difference_from(flats, rig)) refuse_flats(flats, *difference);
    require_every_lamp(lamps, flats, rig);
    const auto is_planned = [&](const FrameRecord& record) {
        return record.kind == FrameKind::flat && record.verified &&
               std::ranges::any_of(lamps, [&](LampId lamp) { return record.lamp == lamp; });
    };
    std::set<std::string> runs;  // which unlit frames belong to flat ones
    for (const FrameRecord& record : flats.frames())
        if (is_planned(record)) runs.insert(record.taken_over_from);
    FlatFrames taken{.of = flats.reference(), .records = {}, .files = {}};
    for (const FrameRecord& record : flats.frames()) {
        if (record.lamp ? !is_planned(record) : !runs.contains(record.taken_over_from)) continue;
        FrameRecord kept = record;
        kept.file = "frames/flat/" + std::filesystem::path(record.file).filename().string();
        if (kept.taken_over_from.empty()) kept.taken_over_from = taken.of.name;
        taken.files.push_back(flats.path_of(record));
        taken.records.push_back(std::move(kept));
    }
    return taken;
}

}  // namespace darkbox
