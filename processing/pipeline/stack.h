#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/maps/maps.h"
#include "processing/maps/photo_source.h"
#include "processing/pipeline/radiance.h"

namespace darkbox {

/// The lit photographs. Throws InputError for none.
std::vector<FrameRecord> require_lit(const Session& session);

/// The lit frames as linear radiance: decoded, linearised by each frame's transfer curve, black level or the mean
/// lamps-off frame of the same exposure and gain subtracted (never both). The mask is data/masks/mask.png cut at half,
/// else found by automatic_mask(). Throws InputError for no lit frame, frames that cannot be read, or sizes that
/// differ.
PhotoStack load_stack(const Session& session, const WorkContext& work = {});
/// The stack's mask alone: where it is not given, photographs are read for it, but few rows of them are held at a time.
cv::Mat1b load_mask(const Session& session, const WorkContext& work = {});

/// The same photographs for stages that work by bands of rows: nothing is held whole but what the mask needs, where it
/// is not given. Refers to the session. Thread-compatible.
class SessionPhotos : public PhotoSource {
public:
    /// Opens the files. Throws InputError as load_stack() does.
    explicit SessionPhotos(const Session& session);

    cv::Size size() const override { return frames_->size(); }
    std::size_t count() const override { return frames_->count(); }
    std::size_t bytes_per_row() const override { return frames_->bytes_per_row(); }
    std::size_t bytes_held() const override;
    void read_next(int rows, PhotoBand& band) override;
    /// Opens the files again.
    void rewind() override;
    cv::Mat1b mask() const override;

    /// Some of the rows read so far, in order, spread evenly over the picture: all of them for small pictures, else so
    /// many that all photographs together hold `most_kept_samples` pixels. For checks that need no more.
    const std::vector<PhotoRows>& kept_rows() const { return kept_; }
    /// One row in so many is kept.
    int kept_row_step() const { return keep_every_; }
    /// The mask of these rows; ask after the last band.
    cv::Mat1b kept_mask() const;
    /// Both as linear radiance.
    PhotoStack kept_stack() const;

    static constexpr std::size_t most_kept_samples = 4'000'000;

private:
    void look_for_brightest(const PhotoBand& band);
    void keep_rows(const PhotoBand& band);

    const Session& session_;
    std::optional<FrameBands> frames_;  ///< always there; opened again to rewind
    std::vector<std::string> files_;
    std::optional<cv::Mat1b> given_mask_;
    std::vector<cv::Vec3d> balls_;  ///< in view beside the object
    cv::Mat1f brightest_;           ///< greatest luminance under any lamp; empty where the mask is given
    int keep_every_ = 1;
    std::vector<PhotoRows> kept_;
};

/// Pixels lit well above the background in the brightest of all images (Otsu's threshold), largest connected part,
/// holes filled, without the discs (x, y, radius in pixels) to be left out. Throws InputError when nothing is lit.
cv::Mat1b automatic_mask(const std::vector<cv::Mat3f>& images, const std::vector<cv::Vec3d>& without);
/// The same from the greatest channel mean that each pixel showed under any lamp.
cv::Mat1b mask_of_brightest(const cv::Mat1f& brightest, const std::vector<cv::Vec3d>& without);

}  // namespace darkbox
