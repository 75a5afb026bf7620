#include "rig/capture/capture_session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <span>
#include <sstream>

#include "acquisition/frame/error.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/light_dose.h"
#include "rig/capture/meter.h"
#include "rig/capture/retake.h"
#include "rig/capture/session_recorder.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr const char* rig_file = "rig.toml";
/// The note that keeps the chosen lamps, so that a resume need not be told them again. Lamp names have no spaces.
constexpr const char* lamps_note = "lamps: ";
/// The same for an exposure that is not rig.toml's.
constexpr const char* exposure_note = "exposure in us: ";

std::vector<std::string> lamps_of(const CapturePlan& plan, const RigDescription& rig) {
    std::vector<std::string> names;
    std::set<LampId> known;
    for (const Shot& shot : plan.shots)
        if (shot.lamp && known.insert(*shot.lamp).second) names.push_back(rig.lamps.at(shot.lamp->value).name);
    return names;
}

std::optional<std::string> noted(const SessionInfo& info, const std::string& prefix) {
    for (const std::string& note : info.notes)
        if (note.starts_with(prefix)) return note.substr(prefix.size());
    return std::nullopt;
}

/// The lamps that an interrupted session was begun with.
std::vector<std::string> lamps_of(const SessionInfo& info) {
    if (const auto note = noted(info, lamps_note)) {
        std::istringstream words(*note);
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

/// A session, open for writing, what is to be captured for it, and the order of its frames in the end.
struct Begun {
    SessionWriter writer;
    CapturePlan plan;
    std::vector<std::string> order;
};

std::vector<std::string> files_of(const CapturePlan& plan) {
    std::vector<std::string> files;
    for (const Shot& shot : plan.shots) files.push_back(file_of(shot));
    return files;
}

void keep_rig(SessionWriter& writer, const RigDescription& rig) {
    writer.add_extra(rig_file, std::as_bytes(std::span(rig.toml)));
}

/// Metering's light counts, too.
Metering meter(const CaptureRequest& request, const RigDescription& rig, const CaptureDevices& devices,
               const WorkContext& work, const TimingLookup& timings) {
    const std::vector<LampId> wanted = lamps_named(rig, request.lamps);
    if (!knows_doses(rig)) return meter_exposure(rig, wanted, devices, work, timings);
    const fs::path folder = fs::absolute(request.folder);
    DoseBook book(folder.parent_path());
    DosedLamps lamps(devices.lamps, devices.clock, rig, book, request.object, folder.filename().string());
    const Metering found = meter_exposure(rig, wanted, {lamps, devices.camera, devices.clock}, work, timings);
    lamps.finish();
    return found;
}

/// Sets rig.camera.exposure to what the request wants; says what was found where that was metered.
std::optional<std::string> settle_exposure(const CaptureRequest& request, RigDescription& rig,
                                           const CaptureDevices& devices, const WorkContext& work,
                                           const TimingLookup& timings) {
    const bool metered = request.exposure ? !request.exposure->fixed : rig.capture.metered;
    if (!metered) {
        if (request.exposure) rig.camera.exposure = *request.exposure->fixed;
        return std::nullopt;
    }
    const Metering found = meter(request, rig, devices, work, timings);
    rig.camera.exposure = found.exposure;
    return found.words();
}

Begun create(const CaptureRequest& request, RigDescription& rig, const CaptureDevices& devices, const WorkContext& work,
             const TimingLookup& timings) {
    const Seconds described = rig.camera.exposure;
    const auto metered = settle_exposure(request, rig, devices, work, timings);
    CapturePlan plan = plan_capture(rig, request.lamps);
    SessionInfo info = session_info(rig, devices.camera.configure(plan.shots.front().camera), request.object, plan);
    info.record = request.record;
    if (rig.camera.exposure != described)
        info.notes.push_back(fmt::format("{}{}", exposure_note, rig.camera.exposure.count() * 1e6));
    SessionWriter writer = SessionWriter::create(request.folder, info);
    keep_rig(writer, rig);
    if (metered) writer.note_event(*metered);
    std::vector<std::string> order = files_of(plan);
    return {std::move(writer), std::move(plan), std::move(order)};
}

/// The frames that are not there yet: an earlier run may have been stopped on its way through them.
void take_over(SessionWriter& writer, const Retake& retake) {
    std::set<std::string> there;
    for (const FrameRecord& record : writer.acknowledged()) there.insert(record.file);
    for (std::size_t i = 0; i < retake.files.size(); ++i)
        if (!there.contains(retake.taken_over[i].file)) writer.take_over(retake.files[i], retake.taken_over[i]);
}

Begun create_retake(const CaptureRequest& request, const RigDescription& rig, Camera& camera) {
    if (request.exposure)
        throw InputError("a re-take keeps its session's exposure", "leave out the exposure, or capture a new session");
    const Session old = Session::open(*request.retake);
    Retake retake = plan_retake(old, rig, request.lamps);
    const CameraConfig& config = retake.plan.shots.front().camera;
    const CameraInfo present = camera.configure(config);
    require_same_camera(old, present, config);
    SessionInfo info =
        session_info(rig, present, request.object.empty() ? old.info().object : request.object, retake.plan);
    info.planned_shots = static_cast<int>(retake.order.size());
    info.record = request.record.empty() ? old.info().record : request.record;
    info.retakes = retake.of;
    SessionWriter writer = SessionWriter::create(request.folder, info);
    keep_rig(writer, rig);
    take_over(writer, retake);
    writer.note_event(fmt::format("takes over {} frames of session {}, and takes {} again", retake.taken_over.size(),
                                  retake.of.name, fmt::join(lamps_of(retake.plan, rig), ", ")));
    return {std::move(writer), std::move(retake.plan), std::move(retake.order)};
}

/// What the interrupted session was to become.
Retake plan_of(const SessionWriter& writer, const RigDescription& rig) {
    const std::vector<std::string> lamps = lamps_of(writer.info());
    if (const auto& reference = writer.info().retakes) {
        const fs::path folder = fs::absolute(writer.folder()).parent_path() / reference->name;
        const Session old = Session::open(folder);
        if (old.reference() != *reference)
            throw InputError(fmt::format("{} is not the session that the re-take was begun with", folder.string()),
                             "bring that one back beside it");
        return plan_retake(old, rig, lamps);
    }
    Retake whole;
    whole.plan = plan_capture(rig, lamps);
    whole.order = files_of(whole.plan);
    return whole;
}

Begun resume(const CaptureRequest& request, RigDescription& rig) {
    if (request.exposure || request.retake)
        throw InputError("a resumed session keeps its exposure and its plan", "leave out --exposure and --retake");
    SessionWriter writer = SessionWriter::resume(request.folder);
    // A run killed before its first frame may have died before rig.toml was kept, too.
    if (writer.acknowledged().empty() && !fs::exists(writer.folder() / "data" / rig_file)) keep_rig(writer, rig);
    check_same_rig(writer, rig);
    if (const auto note = noted(writer.info(), exposure_note)) rig.camera.exposure = Seconds(std::stod(*note) / 1e6);
    Retake begun = plan_of(writer, rig);
    if (!request.lamps.empty()) check_same_lamps(plan_capture(rig, request.lamps), begun.plan, rig);
    writer.note_event(fmt::format("resumed with {} of {} frames", writer.acknowledged().size(), begun.order.size()));
    take_over(writer, begun);
    return {std::move(writer), std::move(begun.plan), std::move(begun.order)};
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
    info.camera = identity_of(camera);
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
    const CaptureDevices devices{lamps, camera, clock};
    Begun begun = request.start == CaptureStart::resume ? resume(request, rig)
                  : request.retake                      ? create_retake(request, rig, camera)
                                                        : create(request, rig, devices, work, timings);
    CaptureSummary summary;
    {
        SessionRecorder recorder(begun.writer);
        ToldSink told(recorder, request.listener);
        for (const std::string& note : request.notes) told.note_event(note);
        summary = take_shots(begun, rig, devices, told, work, timings);
        recorder.finish();
        summary.most_queued = recorder.most_queued();
    }
    const SessionReview review = request.review ? request.review(begun.writer) : SessionReview{};
    for (const std::string& finding : review.findings) {
        begun.writer.note_event(finding);
        if (request.listener.event) request.listener.event(finding);
    }
    return {begun.writer.seal(begun.order, review.doubts), summary, review.findings};
}

}  // namespace darkbox
