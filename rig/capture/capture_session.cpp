#include "rig/capture/capture_session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <span>
#include <sstream>
#include <utility>

#include "acquisition/frame/error.h"
#include "rig/capture/dosed_lamps.h"
#include "rig/capture/flat_frames.h"
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
/// The same for frames that are not of an object.
constexpr const char* kind_note = "frames of kind: ";

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
    LightDose metered = {};  ///< what metering gave the object
};

std::vector<std::string> files_of(const CapturePlan& plan) {
    std::vector<std::string> files;
    for (const Shot& shot : plan.shots) files.push_back(file_of(shot));
    return files;
}

void keep_rig(SessionWriter& writer, const RigDescription& rig) {
    writer.add_extra(rig_file, std::as_bytes(std::span(rig.toml)));
}

struct Metered {
    Metering found;
    LightDose given;
};

/// Metering's light counts, too.
Metered meter(const CaptureRequest& request, const RigDescription& rig, const CaptureDevices& devices,
              const WorkContext& work, const TimingLookup& timings) {
    const std::vector<LampId> wanted = lamps_named(rig, request.lamps);
    if (!knows_doses(rig)) return {meter_exposure(rig, wanted, devices, work, timings), {}};
    const fs::path folder = fs::absolute(request.folder);
    DoseBook book(folder.parent_path());
    DosedLamps lamps(devices.lamps, devices.clock, rig, book, request.object, folder.filename().string());
    const Metering found = meter_exposure(rig, wanted, {lamps, devices.camera, devices.clock}, work, timings);
    lamps.finish();
    return {found, lamps.given()};
}

/// Sets rig.camera.exposure to what metering finds, where that is wanted, and says what it was.
std::optional<Metered> meter_if_wanted(const CaptureRequest& request, RigDescription& rig,
                                       const CaptureDevices& devices, const WorkContext& work,
                                       const TimingLookup& timings) {
    const bool wanted = request.exposure ? !request.exposure->fixed : rig.capture.metered;
    if (!wanted) return std::nullopt;
    Metered done = meter(request, rig, devices, work, timings);
    rig.camera.exposure = done.found.exposure;
    return done;
}

/// The frames that are not there yet: an earlier run may have been stopped on its way through them.
void take_over(SessionWriter& writer, const std::vector<fs::path>& files, const std::vector<FrameRecord>& records) {
    std::set<std::string> there;
    for (const FrameRecord& record : writer.acknowledged()) there.insert(record.file);
    for (std::size_t i = 0; i < files.size(); ++i)
        if (!there.contains(records[i].file)) writer.take_over(files[i], records[i]);
}

void add_flats(Begun& begun, const FlatFrames& flats) {
    take_over(begun.writer, flats.files, flats.records);
    for (const FrameRecord& record : flats.records) begun.order.push_back(record.file);
}

Begun create(const CaptureRequest& request, RigDescription& rig, const CaptureDevices& devices, const WorkContext& work,
             const TimingLookup& timings) {
    const auto card = request.flats ? std::optional(Session::open(*request.flats)) : std::nullopt;
    const auto flats = card ? std::optional(flats_for(lamps_named(rig, request.lamps), *card, rig)) : std::nullopt;
    const Seconds described = rig.camera.exposure;
    if (request.exposure) rig.camera.exposure = request.exposure->fixed.value_or(described);
    // Before metering, whose light is the object's.
    if (card) require_camera_of_flats(*card, devices.camera.configure({rig.camera.exposure, rig.camera.gain}));
    const auto metered = meter_if_wanted(request, rig, devices, work, timings);
    CapturePlan plan = plan_capture(rig, request.lamps, request.kind);
    const CameraInfo camera = devices.camera.configure(plan.shots.front().camera);
    SessionInfo info = session_info(rig, camera, request.object, plan);
    info.record = request.record;
    if (request.kind != FrameKind::lit) info.notes.push_back(kind_note + std::string(name(request.kind)));
    if (flats) {
        info.flats = flats->of;
        info.planned_shots += static_cast<int>(flats->records.size());
    }
    if (rig.camera.exposure != described)
        info.notes.push_back(fmt::format("{}{}", exposure_note, rig.camera.exposure.count() * 1e6));
    SessionWriter writer = SessionWriter::create(request.folder, info);
    keep_rig(writer, rig);
    if (metered) writer.note_event(metered->found.words());
    std::vector<std::string> order = files_of(plan);
    Begun begun{std::move(writer), std::move(plan), std::move(order), metered ? metered->given : LightDose{}};
    if (flats) add_flats(begun, *flats);
    return begun;
}

Begun create_retake(const CaptureRequest& request, const RigDescription& rig, Camera& camera) {
    if (request.exposure || request.flats || request.kind != FrameKind::lit)
        throw InputError("a re-take keeps its session's exposure and kind of frames",
                         "leave out the exposure, the plan and the flat frames, or capture a new session");
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
    info.flats = old.info().flats;
    SessionWriter writer = SessionWriter::create(request.folder, info);
    keep_rig(writer, rig);
    take_over(writer, retake.files, retake.taken_over);
    writer.note_event(fmt::format("takes over {} frames of session {}, and takes {} again", retake.taken_over.size(),
                                  retake.of.name, fmt::join(lamps_of(retake.plan, rig), ", ")));
    return {std::move(writer), std::move(retake.plan), std::move(retake.order), {}};
}

/// The session that this one refers to; it lies in the same folder.
Session beside(const SessionWriter& writer, const SessionReference& reference) {
    const fs::path folder = fs::absolute(writer.folder()).parent_path() / reference.name;
    Session old = Session::open(folder);
    if (old.reference() != reference)
        throw InputError(fmt::format("{} is not the session that this one was begun with", folder.string()),
                         "bring that one back beside it");
    return old;
}

/// The session of the flat frames need not be there any more when all of them are here.
void take_flats_along(Retake& whole, const SessionWriter& writer, const RigDescription& rig,
                      const std::vector<LampId>& lamps) {
    if (!writer.info().flats) return;
    std::vector<std::string> here;
    for (const FrameRecord& record : writer.acknowledged())
        if (!record.taken_over_from.empty()) here.push_back(record.file);
    if (std::cmp_less(whole.plan.shots.size() + here.size(), writer.info().planned_shots)) {
        const FlatFrames flats = flats_for(lamps, beside(writer, *writer.info().flats), rig);
        whole.taken_over = flats.records;
        whole.files = flats.files;
        here.clear();
        for (const FrameRecord& record : flats.records) here.push_back(record.file);
    }
    whole.order.insert(whole.order.end(), here.begin(), here.end());
}

/// What the interrupted session was to become.
Retake plan_of(const SessionWriter& writer, const RigDescription& rig) {
    const std::vector<std::string> lamps = lamps_of(writer.info());
    if (const auto& reference = writer.info().retakes) return plan_retake(beside(writer, *reference), rig, lamps);
    Retake whole;
    const auto kind = noted(writer.info(), kind_note);
    whole.plan = plan_capture(rig, lamps, kind ? frame_kind_from_name(*kind).value_or(FrameKind::lit) : FrameKind::lit);
    whole.order = files_of(whole.plan);
    take_flats_along(whole, writer, rig, lamps_named(rig, lamps));
    return whole;
}

Begun resume(const CaptureRequest& request, RigDescription& rig) {
    if (request.exposure || request.retake || request.flats || request.kind != FrameKind::lit)
        throw InputError("a resumed session keeps its exposure and its plan",
                         "leave out --exposure, --plan flat, --retake and --flats-from");
    SessionWriter writer = SessionWriter::resume(request.folder);
    // A run killed before its first frame may have died before rig.toml was kept, too.
    if (writer.acknowledged().empty() && !fs::exists(writer.folder() / "data" / rig_file)) keep_rig(writer, rig);
    check_same_rig(writer, rig);
    if (const auto note = noted(writer.info(), exposure_note)) rig.camera.exposure = Seconds(std::stod(*note) / 1e6);
    Retake begun = plan_of(writer, rig);
    if (!request.lamps.empty()) check_same_lamps(plan_capture(rig, request.lamps), begun.plan, rig);
    writer.note_event(fmt::format("resumed with {} of {} frames", writer.acknowledged().size(), begun.order.size()));
    take_over(writer, begun.files, begun.taken_over);
    return {std::move(writer), std::move(begun.plan), std::move(begun.order), {}};
}

/// The plan's lamps whose frames are not there yet.
std::vector<LampId> lamps_to_come(const Begun& begun) {
    std::vector<LampId> lamps;
    for (const Shot& shot : begun.plan.shots) {
        const auto& records = begun.writer.acknowledged();
        const bool there = std::any_of(records.begin(), records.end(),
                                       [&](const FrameRecord& record) { return record.file == file_of(shot); });
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
    DosedLamps lamps(devices.lamps, devices.clock, rig, book, begun.writer.info().object, folder.filename().string(),
                     begun.metered);
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

CapturedSession capture_session(const CaptureRequest& asked, const RigDescription& description, LampArray& lamps,
                                Camera& camera, Clock& clock, const WorkContext& work, const TimingLookup& timings) {
    const DarkOnExit dark_on_exit(lamps);
    CaptureRequest request = asked;
    if (request.kind == FrameKind::flat && request.object.empty()) request.object = flat_object;
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
