#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "acquisition/session/session.h"
#include "processing/maps/photo_source.h"
#include "processing/pipeline/radiance.h"

namespace darkbox {

/// The lit photographs by bands of rows for stages that know the object from earlier maps: bands come without a mask.
/// Refers to the session. Thread-compatible.
class LitPhotos : public PhotoSource {
public:
    /// Opens the files. Throws InputError for no lit frame, files that cannot be read, or sizes that differ.
    explicit LitPhotos(const Session& session) : session_(session) { rewind(); }

    cv::Size size() const override { return frames_->size(); }
    std::size_t count() const override { return frames_->count(); }
    std::size_t bytes_per_row() const override { return frames_->bytes_per_row(); }
    std::size_t bytes_held() const override { return 0; }
    void read_next(int rows, PhotoBand& band) override { frames_->read_next(rows, band); }
    /// Opens the files again.
    void rewind() override;
    /// None.
    cv::Mat1b mask() const override { return {}; }

private:
    const Session& session_;
    std::optional<FrameBands> frames_;
};

}  // namespace darkbox
