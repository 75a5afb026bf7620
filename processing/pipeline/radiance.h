#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/photo_source.h"

namespace darkbox {

class UnlitFrames;

/// One photograph, read from the top. Thread-compatible.
class PhotoReader {
public:
    virtual ~PhotoReader() = default;
    virtual cv::Size size() const = 0;
    virtual std::size_t bytes_per_pixel() const = 0;
    /// The next rows.
    virtual void read_next(int rows, PhotoRows& photo) = 0;
};

/// Photographs of a session, captured or imported, read together from the top. They come as they were decoded, with
/// what makes radiance of them: each frame's transfer curve, and what stood there without a lamp where the session has
/// frames of that (see unlit_frames.h; they hold the black level already), else the black level. Several frames of one
/// lamp are merged. 1.0 = full scale after the black level, of merged ones in the first frame's exposure.
/// Thread-compatible.
class FrameBands {
public:
    /// Opens every file. Throws InputError for one that cannot be read, or is of another size than the first.
    FrameBands(const Session& session, const std::vector<FrameRecord>& photographs);
    ~FrameBands();

    cv::Size size() const { return size_; }
    std::size_t count() const { return photos_.size(); }
    /// Memory of one row in a band.
    std::size_t bytes_per_row() const;
    /// The next rows of every photograph; files are read in parallel. The band's mask is left alone.
    void read_next(int rows, PhotoBand& band);

private:
    std::unique_ptr<PhotoReader> open(const Session& session, const FrameRecord& photograph,
                                      const std::vector<FrameRecord>& served);
    const UnlitFrames* unlit_for(const Session& session, const FrameRecord& frame,
                                 const std::vector<FrameRecord>& served);

    cv::Size size_;
    std::vector<std::unique_ptr<UnlitFrames>> unlit_;
    std::vector<std::unique_ptr<PhotoReader>> photos_;
    int next_row_ = 0;
};

/// Radiance of every sRGB-encoded sample 0...full_scale.
std::shared_ptr<const std::vector<float>> srgb_curve(int full_scale);

/// A frame as linear radiance.
struct Radiance {
    cv::Mat3f image;
    cv::Mat1b clipped;  ///< 255 where any channel was at full scale
};

/// Passes over photographs from the top: `visit` sees band after band, each while the next is read. Two bands are in
/// memory, of 64 rows or as many fewer (not below 16) as keep each within 32 MiB. `progress.done` counts rows from
/// where it is.
void for_bands(FrameBands& photographs, const WorkContext& work, ProgressUpdate progress,
               const std::function<void(const PhotoBand&)>& visit);

/// Passes over `frames` one by one in their order, each whole as radiance. So many are in memory as 512 MiB hold, at
/// least one: frames that share dark frames are the quicker the more of them are read together.
void for_radiances(const Session& session, const std::vector<FrameRecord>& frames, const WorkContext& work,
                   const std::function<void(std::size_t, const Radiance&)>& visit);

/// How many pictures of `bytes` each are held at a time where one after the other is needed whole.
std::size_t pictures_at_once(std::size_t bytes);

/// All of `frames` in their order, whole.
std::vector<Radiance> read_radiances(const Session& session, const std::vector<FrameRecord>& frames,
                                     const WorkContext& work);

}  // namespace darkbox
