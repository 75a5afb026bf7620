#include "rig/health/frame_review.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "acquisition/session/frame_file.h"
#include "rig/health/known_lamps.h"
#include "rig/health/luminance.h"
#include "rig/health/movement.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr double most_pixels = 4e5;  ///< of a picture; those of 64 lamps then take 100 MB

Luminance read_luminance(const SessionWriter& session, const FrameRecord& record) {
    return luminance_of(read_frame(session.folder() / "data" / record.file, record));
}

LampPicture small_picture(const SessionWriter& session, const FrameRecord& record) {
    LampPicture picture{record.lamp_name, read_luminance(session, record).light};
    const auto shrink =
        static_cast<int>(std::ceil(std::sqrt(static_cast<double>(picture.light.total()) / most_pixels)));
    if (shrink > 1) {
        cv::Mat1f small;
        cv::resize(picture.light, small, {picture.light.cols / shrink, picture.light.rows / shrink}, 0, 0,
                   cv::INTER_AREA);
        picture.light = small;
    }
    picture.factor = static_cast<double>(record.width) / picture.light.cols;
    return picture;
}

/// Of every lamp its first frame.
std::vector<LampPicture> lamp_pictures(const SessionWriter& session) {
    std::vector<LampPicture> pictures;
    std::set<std::string> there;
    for (const FrameRecord& record : session.acknowledged())
        if (record.kind == FrameKind::lit && there.insert(record.lamp_name).second)
            pictures.push_back(small_picture(session, record));
    return pictures;
}

void review_places(const SessionWriter& session, const RigDescription& rig, const BallPlaces& seen,
                   SessionReview& review) {
    const fs::path folder = fs::absolute(session.folder());
    const auto calibrated = calibrated_lamps(folder.parent_path(), rig, folder.filename().string());
    const KnownLamps known = calibrated ? *calibrated : described_lamps(rig);
    const bool becomes_reference = session.info().object == recalibration_object;
    for (const PlaceFinding& finding : compare_places(seen, known)) {
        review.findings.push_back(finding.words);
        if (becomes_reference) continue;
        for (const FrameRecord& record : session.acknowledged())
            if (record.kind == FrameKind::lit && std::ranges::count(finding.unlike, record.lamp_name) > 0)
                review.doubts.push_back({record.file, finding.words});
    }
}

/// Two frames of one lamp that this session took.
struct FrameSpan {
    FrameRecord first, last;
    std::int64_t length_ns() const { return last.timestamp_ns - first.timestamp_ns; }
};

/// The longest in time. Frames taken over have another clock.
std::optional<FrameSpan> longest_span(const SessionWriter& session) {
    std::map<std::string, FrameSpan> spans;
    for (const FrameRecord& record : session.acknowledged()) {
        if (record.kind != FrameKind::lit || !record.taken_over_from.empty()) continue;
        FrameSpan& span = spans.try_emplace(record.lamp_name, FrameSpan{record, record}).first->second;
        if (record.timestamp_ns < span.first.timestamp_ns) span.first = record;
        if (record.timestamp_ns > span.last.timestamp_ns) span.last = record;
    }
    std::optional<FrameSpan> longest;
    for (const auto& [lamp, span] : spans)
        if (span.length_ns() > 0 && (!longest || span.length_ns() > longest->length_ns())) longest = span;
    return longest;
}

void review_movement(const SessionWriter& session, const FrameSpan& span, const std::optional<BallPlaces>& seen,
                     SessionReview& review) {
    const Luminance before = read_luminance(session, span.first), after = read_luminance(session, span.last);
    const double factor = static_cast<double>(span.first.width) / before.light.cols;  // of a mosaic 2
    std::vector<Ball> balls;
    if (seen) {
        Ball& ball = balls.emplace_back(seen->ball);
        ball.x = (ball.x + 0.5) / factor - 0.5;
        ball.y = (ball.y + 0.5) / factor - 0.5;
        ball.radius /= factor;
    }
    auto movement = measure_movement(before.light, after.light, cv::Mat1b(~(before.clipped | after.clipped)), balls);
    if (!movement) return;
    for (Shift* shift : {&movement->object, movement->ball ? &*movement->ball : nullptr})
        if (shift) {
            shift->px *= factor;
            shift->sigma_px *= factor;
        }
    if (movement->moved())
        review.findings.push_back(
            fmt::format("{} between the first and the last frame of {}, {:.1f} s apart: pictures do not lie on each "
                        "other; look for "
                        "what is loose, let it come to rest, and capture again",
                        movement->words(), span.first.lamp_name, static_cast<double>(span.length_ns()) * 1e-9));
}

}  // namespace

SessionReview review_frames(const SessionWriter& session, const RigDescription& rig) {
    SessionReview review;
    const auto span = longest_span(session);
    if (!rig.capture.lamp_places && !span) return review;
    const auto seen = places_on_ball(lamp_pictures(session), rig);
    if (seen && rig.capture.lamp_places) review_places(session, rig, *seen, review);
    if (span) review_movement(session, *span, seen, review);
    return review;
}

}  // namespace darkbox
