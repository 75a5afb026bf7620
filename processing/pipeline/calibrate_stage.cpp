#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "acquisition/frame/error.h"
#include "processing/calibration/lamp_checks.h"
#include "processing/calibration/warnings.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/json_file.h"
#include "processing/formats/light_files.h"
#include "processing/formats/picture.h"
#include "processing/formats/png.h"
#include "processing/maps/parallel.h"
#include "processing/pipeline/ball_focus.h"
#include "processing/pipeline/ball_picture.h"
#include "processing/pipeline/given_lights.h"
#include "processing/pipeline/intensities.h"
#include "processing/pipeline/session_ball.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/session_geometry.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "processing/pipeline/steps.h"
#include "processing/pipeline/summary_json.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

RigIdentity rig_of(const Session& session, const std::vector<FrameRecord>& lit) {
    RigIdentity rig{session.info().rig, {}};
    for (const FrameRecord& frame : lit) rig.lamps.push_back(frame.lamp_name);
    return rig;
}

Calibration from_given(const GivenLights& given) {
    Calibration calibration;
    calibration.lights = given.lights;
    calibration.highlights.resize(given.lights.size());
    calibration.condition_number = condition_number(given.lights);
    calibration.method = "given";
    calibration.intensity_origin = given.intensities ? IntensityOrigin::given : IntensityOrigin::unknown;
    calibration.warnings = given.warnings;
    return calibration;
}

/// By the lamp's name; by its place only where the caller knows that the lamps are the same ones.
const Light& stored_light(const StoredCalibration& stored, const FrameRecord& frame, std::size_t place,
                          OtherRig other_rig, const fs::path& file) {
    const std::vector<std::string>& lamps = stored.rig.lamps;
    const auto named = std::find(lamps.begin(), lamps.end(), frame.lamp_name);
    if (!frame.lamp_name.empty() && named != lamps.end())
        return stored.calibration.lights[static_cast<std::size_t>(named - lamps.begin())];
    if (other_rig == OtherRig::refuse)
        throw InputError(fmt::format("{} has no light for {}", file.string(), basename_of(frame)),
                         "use a calibration of the same lamps");
    return stored.calibration.lights[place];
}

/// Lights of another rig would be taken for this one's, and nothing would look wrong but the normals.
void require_same_lamps(const StoredCalibration& stored, const RigIdentity& rig, OtherRig other_rig,
                        const fs::path& file) {
    if (other_rig == OtherRig::refuse) {
        if (const std::string why = difference(stored.rig, rig); !why.empty())
            throw InputError(fmt::format("{} is not a calibration of this session's lamps: {}", file.string(), why),
                             "use a calibration of the same lamps; if these are the same lamps in the same order, say "
                             "so with --any-rig");
    } else if (stored.calibration.lights.size() != rig.lamps.size()) {
        throw InputError(fmt::format("{} has {} lights for {} frames: their places do not tell which is which",
                                     file.string(), stored.calibration.lights.size(), rig.lamps.size()),
                         "use a calibration of as many lamps");
    }
}

Calibration from_stored(const fs::path& from, OtherRig other_rig, const RigIdentity& rig,
                        const std::vector<FrameRecord>& lit) {
    const fs::path file = fs::is_directory(from) ? ResultFiles(from).calibration : from;
    const StoredCalibration stored = read_calibration(file);
    require_same_lamps(stored, rig, other_rig, file);
    Calibration calibration;
    for (std::size_t i = 0; i < lit.size(); ++i) {
        calibration.lights.push_back(stored_light(stored, lit[i], i, other_rig, file));
        calibration.lights.back().file = basename_of(lit[i]);
    }
    calibration.highlights.resize(lit.size());
    calibration.view = stored.calibration.view;
    calibration.condition_number = condition_number(calibration.lights);
    calibration.method = "stored: " + file.string();
    calibration.intensity_origin = stored.calibration.intensity_origin;
    return calibration;
}

/// Where lights are not read off a ball, what is said about the ball would have no effect.
void require_effect(const CalibrateOptions& options, const std::string& instead) {
    const CalibrationOptions& calibration = options.calibration;
    std::vector<std::string> idle;
    if (!calibration.balls.empty()) idle.emplace_back("--ball");
    if (options.ball_mask) idle.emplace_back("--ball-mask");
    if (calibration.ball_diameter_mm) idle.emplace_back("--ball-diameter");
    if (!calibration.highlights.empty()) idle.emplace_back("--highlight");
    if (calibration.lamps != LampModel::automatic) idle.emplace_back("--lamps");
    if (calibration.method != CalibrationMethod::refined) idle.emplace_back("--method");
    if (options.photometric) idle.emplace_back("--photometric");
    if (!idle.empty())
        throw InputError(fmt::format("{} would have no effect: the lights {}", fmt::join(idle, ", "), instead),
                         "leave it out, or have the lights read off a ball (--ball X,Y,R, without --from)");
}

/// A list of balls, or one alone.
std::vector<Ball> read_balls(const fs::path& path) {
    const auto json = read_json(path);
    return reading_keys(path, "a ball", [&] {
        const auto ball_in = [](const auto& j) {
            return Ball{j.at("x").template get<double>(), j.at("y").template get<double>(),
                        j.at("radius").template get<double>(), 1.0};
        };
        std::vector<Ball> balls;
        if (!json.contains("balls")) return std::vector<Ball>{ball_in(json)};
        for (const auto& ball : json.at("balls")) balls.push_back(ball_in(ball));
        return balls;
    });
}

/// Pixels of the object, of a part of the picture's rows where that is large.
ObjectPixels pixels_of_object(const Session& session, const WorkContext& work) {
    constexpr int rows_at_once = 64;
    SessionPhotos photos(session);
    const int height = photos.size().height;
    PhotoBand band;
    for (int row = 0; row < height; row += rows_at_once)
        on_threads_of(work, [&] { photos.read_next(std::min(rows_at_once, height - row), band); });
    ObjectPixels pixels = object_pixels(photos.kept_stack());
    for (cv::Point2d& at : pixels.at) at.y *= photos.kept_row_step();
    return pixels;
}

/// What was given at import holds unless the command says otherwise.
CalibrationOptions with_imported(const Session& session, const CalibrateOptions& asked) {
    CalibrationOptions options = asked.calibration;
    if (asked.ball_mask) options.ball_mask = read_mask(*asked.ball_mask);
    if (!options.balls.empty() || options.ball_mask) return options;
    if (const auto ball = extra_of(session, given_ball))
        options.balls = read_balls(*ball);
    else if (const auto mask = extra_of(session, ball_mask))
        options.ball_mask = read_mask(*mask);
    return options;
}

/// A rig's own lamp that cannot be read is either left out on purpose or an error: results never rest on fewer lamps
/// than its user knows of. Imported frames go on without it, as calibrate() has warned, while most of them are left.
void require_highlights(const Session& session, const Calibration& calibration,
                        const std::vector<std::string>& dropped) {
    std::vector<std::string> unread;
    for (std::size_t i = 0; i < calibration.lights.size(); ++i) {
        const std::string& file = calibration.lights[i].file;
        if (!calibration.highlights[i] && std::find(dropped.begin(), dropped.end(), file) == dropped.end())
            unread.push_back(file);
    }
    const bool imported = session.info().source == "import";
    const bool enough = direction_matrix(calibration.lights).rows() >= 3 &&
                        2 * unread.size() < calibration.lights.size() - dropped.size();
    if (unread.empty() || (imported && enough)) return;
    const Ball ball = calibration.balls.empty() ? Ball{} : calibration.balls.front();
    throw InputError(
        fmt::format("the ball at ({:.1f}, {:.1f}) of radius {:.1f} shows no usable highlight of the lamp in {}", ball.x,
                    ball.y, ball.radius, fmt::join(unread, ", ")),
        fmt::format("if that is not the ball, give --ball X,Y,R; else leave a frame out with --drop {}, or read its "
                    "highlight by hand with --highlight {}=X,Y",
                    unread[0], unread[0]));
}

/// Lights that no ball tells are left out by their frames' names as well.
void leave_out(Calibration& calibration, const std::vector<std::string>& dropped) {
    for (const std::string& file : dropped) {
        const auto light = std::find_if(calibration.lights.begin(), calibration.lights.end(),
                                        [&](const Light& l) { return l.file == file; });
        if (light == calibration.lights.end())
            throw InputError(fmt::format("there is no frame {} to leave out", file),
                             fmt::format("name a frame as {} is named", calibration.lights.front().file));
        light->used = false;
    }
    calibration.condition_number = condition_number(calibration.lights);
}

/// None where nothing stands out from the background: the picture's centre serves then.
std::optional<cv::Point2d> centroid_without_balls(const Session& session, const SessionBall& ball,
                                                  const Calibration& calibration, const WorkContext& work) {
    try {
        if (ball.separate()) return centroid_of(load_mask(session, work));
        std::vector<cv::Vec3d> discs;
        for (const Ball& b : calibration.balls) discs.emplace_back(b.x, b.y, b.radius);
        return centroid_of(mask_of_brightest(ball.brightest_luminance(), discs));
    } catch (const InputError&) {
        return std::nullopt;
    }
}

/// Directions of near lamps hold at the object: where no mask says where that is, the photographs do, less the balls.
void hold_at_object(const Session& session, const SessionBall& ball, Calibration& calibration,
                    const WorkContext& work) {
    const bool near =
        std::any_of(calibration.lights.begin(), calibration.lights.end(), [](const Light& l) { return l.near; });
    if (!near || !calibration.view) return;
    const auto centroid = centroid_without_balls(session, ball, calibration, work);
    if (!centroid) return;
    for (Light& light : calibration.lights) light = held_at(std::move(light), calibration.view->point_at(*centroid));
    calibration.condition_number = condition_number(calibration.lights);
}

std::optional<GreyCard> card_of(const CalibrateOptions& options) {
    std::optional<GreyCard> card = options.grey_card;
    if (!options.grey_card_mask) return card;
    if (!card) card.emplace();
    card->mask = read_mask(*options.grey_card_mask);
    return card;
}

void warn_of_few_lights(Calibration& calibration) {
    const auto used =
        std::count_if(calibration.lights.begin(), calibration.lights.end(), [](const Light& l) { return l.used; });
    if (used < 3)
        calibration.warnings.push_back(
            fmt::format("only {} lights can be used; normals need three that are not in one plane", used));
}

}  // namespace

CalibrateSummary run_calibrate(const Session& session, const CalibrateOptions& options, const WorkContext& work) {
    options.calibration.validate();
    const ResultFiles files(session.folder());
    const std::vector<FrameRecord> lit = photographs_of(session, FrameKind::lit);
    if (lit.empty())
        throw InputError(fmt::format("{} shows no object: it has no frame of kind lit", session.folder().string()),
                         "flat frames go along with an object's: darkbox capture --flats-from SESSION");
    CalibrateSummary summary;
    Stopwatch watch;
    const bool ball_asked_for = !options.calibration.balls.empty() || options.ball_mask;
    const auto given = options.from || ball_asked_for ? std::nullopt : given_lights(session);
    if (options.other_rig == OtherRig::compare && !options.from)
        throw InputError("--any-rig would have no effect without --from", "leave it out");
    if (options.from) {
        require_effect(options, "come from " + options.from->string());
        summary.calibration = from_stored(*options.from, options.other_rig, rig_of(session, lit), lit);
    } else if (given) {
        require_effect(options, "came with the photographs");
        summary.calibration = from_given(*given);
    } else {
        SessionBall ball(session, work);
        CalibrationOptions wanted = with_geometry(session, with_imported(session, options), ball.size());
        if (options.photometric) wanted.object_pixels = pixels_of_object(session, work);
        step(work, {"calibrating lights", 0, 1, "ball and highlights"});
        summary.calibration = calibrate(ball, ball.files(), wanted);
        require_highlights(session, summary.calibration, options.calibration.drop);
        if (!wanted.object) hold_at_object(session, ball, summary.calibration, work);
        append(summary.calibration.warnings, unused_geometry(session, wanted));
        summary.seconds.read = ball.seconds();
        summary.seconds.solve = std::max(0.0, watch.lap() - ball.seconds());
        const BallView view = view_of_balls(ball.brightest(), summary.calibration.balls);
        write_png(files.ball_picture, draw_balls(view, summary.calibration));
        summary.blur_px = ball_blur_px(ball, summary.calibration.balls);
    }
    if (options.from || given) leave_out(summary.calibration, options.calibration.drop);
    summary.calibration = with_measured_intensities(session, std::move(summary.calibration), card_of(options), work);
    if (options.from || given) append(summary.calibration.warnings, warnings_about(summary.calibration));
    warn_of_few_lights(summary.calibration);
    if (const auto described = described_lights(session))
        append(summary.calibration.warnings,
               against_nominal(*described, {rig_of(session, lit), summary.calibration.lights, false}));
    summary.removed = remove_derived(session, {"results", "texels", "shading"});
    if (options.from || given) fs::remove(files.ball_picture);
    write_calibration(files.calibration, summary.calibration, rig_of(session, lit));
    write_lp(files.lights_lp, summary.calibration.lights);
    summary.seconds.write = watch.lap();
    write_json(files.calibration_summary, to_json(summary));
    step(work, {"calibrating lights", 1, 1, ""});
    return summary;
}

Calibration load_calibration(const Session& session) {
    const ResultFiles files(session.folder());
    require_made(files.calibration, session, "calibrate");
    return read_calibration(files.calibration).calibration;
}

Lights load_lights(const Session& session) { return load_calibration(session).lights; }

}  // namespace darkbox
