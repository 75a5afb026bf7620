#include "rig/capture/capture_session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <span>
#include <sstream>

#include "acquisition/frame/error.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"
#include "rig/capture/session_recorder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr const char* rig_file = "rig.toml";
/// The note that keeps the chosen lamps, so that a resume need not be told them again. Lamp names have no spaces.
constexpr const char* lamps_note = "lamps: ";

std::vector<std::string> lamps_of(const CapturePlan& plan, const RigDescription& rig) {
    std::vector<std::string> names;
    for (const Shot& shot : plan.shots)
        if (shot.lamp) names.push_back(rig.lamps.at(shot.lamp->value).name);
    return names;
}

/// The lamps that an interrupted session was begun with.
std::vector<std::string> lamps_of(const SessionInfo& info) {
    const std::string prefix = lamps_note;
    for (const std::string& note : info.notes) {
        if (note.compare(0, prefix.size(), prefix) != 0) continue;
        std::istringstream words(note.substr(prefix.size()));
        return {std::istream_iterator<std::string>(words), {}};
    }
    throw InputError("the session does not say which lamps it was begun with", "capture a new session");
}

void check_same_rig(const SessionWriter& writer, const RigDescription& rig) {
    const fs::path file = writer.folder() / "data" / rig_file;
    std::ifstream in(file, std::ios::binary);
    const std::string stored(std::istreambuf_iterator<char>(in), {});
    if (stored != rig.toml)
        throw InputError(fmt::format("session {} was begun with another rig.toml", writer.folder().string()),
                         fmt::format("resume it with {}, or capture a new session", file.string()));
}

void check_same_lamps(const CapturePlan& asked, const CapturePlan& begun, const RigDescription& rig) {
    if (lamps_of(asked, rig) != lamps_of(begun, rig))
        throw InputError(
            "the session was begun with other lamps",
            fmt::format("resume it without naming lamps; its lamps are: {}", fmt::join(lamps_of(begun, rig), ", ")));
}

/// A session, open for writing, and what it is to hold.
struct Begun {
    SessionWriter writer;
    CapturePlan plan;
};

void keep_rig(SessionWriter& writer, const RigDescription& rig) {
    writer.add_extra(rig_file, std::as_bytes(std::span(rig.toml)));
}

Begun create(const CaptureRequest& request, const RigDescription& rig, Camera& camera) {
    CapturePlan plan = plan_capture(rig, request.lamps);
    const CameraInfo info = camera.configure(plan.shots.front().camera);
    SessionWriter writer = SessionWriter::create(request.folder, session_info(rig, info, request.object, plan));
    keep_rig(writer, rig);
    return {std::move(writer), std::move(plan)};
}

Begun resume(const CaptureRequest& request, const RigDescription& rig) {
    SessionWriter writer = SessionWriter::resume(request.folder);
    // A run killed before its first frame may have died before rig.toml was kept, too.
    if (writer.acknowledged().empty() && !fs::exists(writer.folder() / "data" / rig_file)) keep_rig(writer, rig);
    check_same_rig(writer, rig);
    CapturePlan plan = plan_capture(rig, lamps_of(writer.info()));
    if (!request.lamps.empty()) check_same_lamps(plan_capture(rig, request.lamps), plan, rig);
    writer.note_event(fmt::format("resumed with {} of {} frames", writer.acknowledged().size(), plan.shots.size()));
    return {std::move(writer), std::move(plan)};
}

/// The plan's lamps whose frames are not there yet.
std::vector<LampId> lamps_to_come(const Begun& begun) {
    std::vector<LampId> lamps;
    for (const Shot& shot : begun.plan.shots) {
        const auto& records = begun.writer.acknowledged();
        const bool there = std::any_of(records.begin(), records.end(), [&](const FrameRecord& record) {
            return fs::path(record.file).stem() == shot.name;
        });
        if (shot.lamp && !there) lamps.push_back(*shot.lamp);
    }
    return lamps;
}

/// Takes the shots, and counts the light they cost the object where the lamps tell what they give. Nothing is lit when
/// the budget cannot bear the shots that are to come.
CaptureSummary take_shots(Begun& begun, const RigDescription& rig, const CaptureDevices& devices, FrameSink& sink,
                          const WorkContext& work, const TimingLookup& timings) {
    if (!knows_doses(rig)) return run_capture(begun.plan, rig, devices, sink, work, timings);
    const fs::path folder = fs::absolute(begun.writer.folder());
    DoseBook book(folder.parent_path());
    DosedLamps lamps(devices.lamps, devices.clock, rig, book, begun.writer.info().object, folder.filename().string());
    lamps.require_room_for(lamps_to_come(begun));
    const CaptureSummary summary =
        run_capture(begun.plan, rig, {lamps, devices.camera, devices.clock}, sink, work, timings);
    lamps.finish();
    sink.note_event(fmt::format("light dose: {:.4g} lux s, {:.4g} J/m2 of ultraviolet, {:.4g} J/m2 of infrared",
                                lamps.given().lux_s, lamps.given().uv_j_per_m2, lamps.given().ir_j_per_m2));
    return summary;
}

}  // namespace

CaptureGeometry geometry_of(const RigDescription& rig) {
    CaptureGeometry geometry;
    geometry.mm_per_pixel = rig.camera.mm_per_pixel;
    geometry.camera_distance_mm = rig.camera.distance_mm;
    geometry.principal_px = rig.camera.principal_px;
    geometry.ball_diameter_mm = rig.ball_diameter_mm;
    geometry.distant_lamps = rig.distant_lamps;
    for (const LampDescription& lamp : rig.lamps) geometry.lamps.push_back({lamp.name, lamp.position_mm});
    return geometry;
}

SessionInfo session_info(const RigDescription& rig, const CameraInfo& camera, const std::string& object,
                         const CapturePlan& plan) {
    SessionInfo info;
    info.object = object;
    info.created = iso8601_now();
    info.source = "capture";
    info.rig = rig.name;
    info.camera = camera.id.empty() ? camera.model : fmt::format("{} ({})", camera.model, camera.id);
    info.planned_shots = static_cast<int>(plan.shots.size());
    info.geometry = geometry_of(rig);
    info.notes.push_back(lamps_note + fmt::format("{}", fmt::join(lamps_of(plan, rig), " ")));
    info.notes.insert(info.notes.end(), camera.notes.begin(), camera.notes.end());
    return info;
}

CapturedSession capture_session(const CaptureRequest& request, const RigDescription& description, LampArray& lamps,
                                Camera& camera, Clock& clock, const WorkContext& work, const TimingLookup& timings) {
    const DarkOnExit dark_on_exit(lamps);
    RigDescription rig = description;
    rig.capture.mode = request.mode.value_or(rig.capture.mode);
    Begun begun = request.start == CaptureStart::create ? create(request, rig, camera) : resume(request, rig);
    CaptureSummary summary;
    {
        SessionRecorder recorder(begun.writer);
        summary = take_shots(begun, rig, {lamps, camera, clock}, recorder, work, timings);
        recorder.finish();
    }
    return {begun.writer.seal(), summary};
}

}  // namespace darkbox
