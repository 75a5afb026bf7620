#include "processing/pipeline/unlit_frames.h"

#include <algorithm>
#include <cmath>

#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

std::vector<FrameRecord> unlit_like(const Session& session, FrameKind kind, const FrameRecord& lit) {
    std::vector<FrameRecord> frames = frames_of_kind(session, kind);
    std::erase_if(frames, [&](const FrameRecord& frame) {
        return !is_captured(frame) || !same_controls(frame, lit) || frame.taken_over_from != lit.taken_over_from;
    });
    // A frame that differed from the others is kept to show what went wrong.
    const bool some_verified = std::ranges::any_of(frames, &FrameRecord::verified);
    if (some_verified) std::erase_if(frames, [](const FrameRecord& frame) { return !frame.verified; });
    std::ranges::stable_sort(frames, {}, &FrameRecord::timestamp_ns);
    return frames;
}

}  // namespace

UnlitFrames::UnlitFrames(const Session& session, const FrameRecord& lit, const std::vector<FrameRecord>& served)
    : like_(lit) {
    records_ = unlit_like(session, FrameKind::ambient, lit);
    ambient_ = !records_.empty();
    if (ambient_)
        keep_around(served);
    else
        records_ = unlit_like(session, FrameKind::dark, lit);
    for (const FrameRecord& record : records_) frames_.push_back(open_frame_rows(session, record));
}

/// From the last one before the first of them to the first one after the last.
void UnlitFrames::keep_around(const std::vector<FrameRecord>& served) {
    auto earliest = like_.timestamp_ns, latest = like_.timestamp_ns;
    for (const FrameRecord& frame : served) {
        if (!fits(frame)) continue;
        earliest = std::min(earliest, frame.timestamp_ns);
        latest = std::max(latest, frame.timestamp_ns);
    }
    auto end = std::ranges::upper_bound(records_, latest, {}, &FrameRecord::timestamp_ns);
    if (end != records_.end()) ++end;
    records_.erase(end, records_.end());
    auto begin = std::ranges::upper_bound(records_, earliest, {}, &FrameRecord::timestamp_ns);
    if (begin != records_.begin()) --begin;
    records_.erase(records_.begin(), begin);
}

bool UnlitFrames::fits(const FrameRecord& lit) const {
    return same_controls(like_, lit) && like_.taken_over_from == lit.taken_over_from;
}

void UnlitFrames::read_next(int rows, cv::Size size) {
    mean_ = cv::Mat3f(rows, size.width, cv::Vec3f::all(0));
    rows_.resize(ambient_ ? frames_.size() : 0);
    cv::Mat samples, wide;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
        frames_[i]->read(rows, samples);
        samples.convertTo(wide, CV_32F);
        if (ambient_)
            wide.copyTo(rows_[i]);
        else
            mean_ += wide;
    }
    if (!frames_.empty()) mean_ /= static_cast<double>(frames_.size());
}

cv::Mat3f UnlitFrames::level_for(const FrameRecord& lit) const {
    if (!ambient_) return mean_;
    const auto after = std::ranges::upper_bound(records_, lit.timestamp_ns, {}, &FrameRecord::timestamp_ns);
    const auto place = static_cast<std::size_t>(after - records_.begin());
    if (place == 0) return rows_.front();
    if (place == records_.size()) return rows_.back();
    const auto begin = static_cast<double>(records_[place - 1].timestamp_ns);
    const double whole = static_cast<double>(records_[place].timestamp_ns) - begin;
    const double share = (static_cast<double>(lit.timestamp_ns) - begin) / whole;
    cv::Mat3f between;
    cv::addWeighted(rows_[place - 1], 1 - share, rows_[place], share, 0, between);
    return between;
}

}  // namespace darkbox
