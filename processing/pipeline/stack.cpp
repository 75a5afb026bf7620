#include "processing/pipeline/stack.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"
#include "processing/formats/calibration_file.h"
#include "processing/formats/picture.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

std::vector<FrameRecord> require_lit(const Session& session) {
    std::vector<FrameRecord> lit = frames_of_kind(session, FrameKind::lit);
    if (lit.empty())
        throw InputError(fmt::format("{} has no lit frame", session.folder().string()),
                         "capture or import photographs with a lamp on");
    return lit;
}

/// Balls that the calibration found in view beside the object.
std::vector<cv::Vec3d> balls_in_view(const Session& session) {
    const ResultFiles files(session.folder());
    if (!frames_of_kind(session, FrameKind::ball).empty() || !std::filesystem::exists(files.calibration)) return {};
    std::vector<cv::Vec3d> discs;
    for (const Ball& ball : read_calibration(files.calibration).calibration.balls)
        discs.emplace_back(ball.x, ball.y, ball.radius);
    return discs;
}

}  // namespace

PhotoStack load_stack(const Session& session, const WorkContext& work) {
    const std::vector<FrameRecord> lit = require_lit(session);
    PhotoStack stack;
    for (Radiance& radiance : read_radiances(session, lit, work)) {
        stack.images.push_back(std::move(radiance.image));
        stack.clipped.push_back(std::move(radiance.clipped));
    }
    for (const FrameRecord& frame : lit) stack.files.push_back(basename_of(frame));
    const auto mask = extra_of(session, object_mask);
    stack.mask = mask ? read_mask(*mask) : automatic_mask(stack.images, balls_in_view(session));
    require_consistent(stack);
    return stack;
}

BallFrames load_ball_frames(const Session& session, const WorkContext& work) {
    const std::vector<FrameRecord> lit = require_lit(session);
    const std::vector<FrameRecord> own = frames_of_kind(session, FrameKind::ball);
    if (!own.empty() && own.size() != lit.size())
        throw InputError(fmt::format("{} has {} frames of the ball for {} of the object", session.folder().string(),
                                     own.size(), lit.size()),
                         "photograph the ball once under each lamp");
    BallFrames ball;
    ball.separate = !own.empty();
    for (Radiance& radiance : read_radiances(session, ball.separate ? own : lit, work))
        ball.frames.push_back(std::move(radiance.image));
    for (const FrameRecord& frame : lit) ball.files.push_back(basename_of(frame));
    return ball;
}

}  // namespace darkbox
