#include "rig/health/lamp_review.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <set>

#include "acquisition/session/frame_file.h"
#include "rig/health/known_lamps.h"
#include "rig/health/luminance.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr double most_pixels = 4e5;  ///< of a picture; those of 64 lamps then take 100 MB

LampPicture small_picture(const fs::path& file, const FrameRecord& record) {
    LampPicture picture{record.lamp_name, luminance_of(read_frame(file, record)).light};
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
            pictures.push_back(small_picture(session.folder() / "data" / record.file, record));
    return pictures;
}

}  // namespace

SessionReview review_lamp_places(const SessionWriter& session, const RigDescription& rig) {
    SessionReview review;
    const auto seen = places_on_ball(lamp_pictures(session), rig);
    if (!seen) return review;
    const fs::path folder = fs::absolute(session.folder());
    const auto calibrated = calibrated_lamps(folder.parent_path(), rig, folder.filename().string());
    const KnownLamps known = calibrated ? *calibrated : described_lamps(rig);
    const bool becomes_reference = session.info().object == recalibration_object;
    for (const PlaceFinding& finding : compare_places(*seen, known)) {
        review.findings.push_back(finding.words);
        if (becomes_reference) continue;
        for (const FrameRecord& record : session.acknowledged())
            if (record.kind == FrameKind::lit && std::ranges::count(finding.unlike, record.lamp_name) > 0)
                review.doubts.push_back({record.file, finding.words});
    }
    return review;
}

}  // namespace darkbox
