#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/photo_source.h"

namespace darkbox {

/// Frames of a session, captured or imported, read together from the top. They come as they were decoded, with what
/// makes radiance of them: each frame's transfer curve, and the mean lamps-off frame of the same exposure and gain
/// where the session has one (it holds the black level already), else the black level. 1.0 = full scale after the black
/// level. Thread-compatible.
class FrameBands {
public:
    /// Opens every file. Throws InputError for one that cannot be read, or is of another size than the first.
    FrameBands(const Session& session, const std::vector<FrameRecord>& frames);
    ~FrameBands();

    cv::Size size() const { return size_; }
    std::size_t count() const { return frames_.size(); }
    /// Memory of one row in a band.
    std::size_t bytes_per_row() const;
    /// The next rows of every frame; files are read in parallel. The band's mask is left alone.
    void read_next(int rows, PhotoBand& band);

private:
    class Frame;
    class Dark;
    Dark* dark_for(const Session& session, const FrameRecord& frame);

    cv::Size size_;
    std::vector<std::unique_ptr<Dark>> darks_;
    std::vector<std::unique_ptr<Frame>> frames_;
    int next_row_ = 0;
};

/// Radiance of every sRGB-encoded sample 0...full_scale.
std::shared_ptr<const std::vector<float>> srgb_curve(int full_scale);

/// A frame as linear radiance.
struct Radiance {
    cv::Mat3f image;
    cv::Mat1b clipped;  ///< 255 where any channel was at full scale
};

/// All of `frames` in their order, whole.
std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work);

}  // namespace darkbox
