#include "processing/pipeline/frame_rows.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <opencv2/imgproc.hpp>

#include "acquisition/session/frame_file.h"
#include "processing/formats/demosaic.h"
#include "processing/formats/picture_rows.h"
#include "processing/formats/ycc.h"

namespace darkbox {
namespace {

int depth_of(PixelFormat format) { return bytes_per_sample(format) == 1 ? CV_8U : CV_16U; }

/// The session's own files know their rows' places: nothing stays open between reads.
class CapturedRows : public FrameRows {
public:
    CapturedRows(const Session& session, const FrameRecord& record)
        : path_(session.path_of(record)), record_(record), format_(*pixel_format_from_name(record.format)) {}

    cv::Size size() const override { return {record_.width, record_.height}; }
    int type() const override { return CV_MAKETYPE(depth_of(format_), 3); }

    void read(int rows, cv::Mat& samples) override {
        if (const auto pattern = mosaic(format_)) {
            demosaic(with_margins(rows), next_, *pattern, (1 << record_.bit_depth) - 1).copyTo(samples);
        } else {
            Frame frame = read_frame_rows(path_, record_, {next_, rows});
            to_colour(stored(frame), samples);
        }
        next_ += rows;
    }

private:
    static cv::Mat stored(Frame& frame) {
        return {frame.height, frame.width, CV_MAKETYPE(depth_of(frame.format), channels(frame.format)),
                frame.pixels.data()};
    }

    static void to_colour(const cv::Mat& stored, cv::Mat& samples) {
        if (stored.channels() == 3)
            stored.copyTo(samples);
        else if (stored.channels() == 2)
            rgb_of_ycc(stored).copyTo(samples);
        else
            cv::merge(std::array<cv::Mat, 3>{stored, stored, stored}.data(), 3, samples);
    }

    /// The next rows of a mosaic with what demosaic() needs above and below.
    cv::Mat with_margins(int rows) const {
        const int top = std::min(next_, demosaic_margin);
        const int bottom = std::min(record_.height - next_ - rows, demosaic_margin);
        Frame frame = read_frame_rows(path_, record_, {next_ - top, top + rows + bottom});
        const cv::Mat band = stored(frame);
        cv::Mat padded;
        cv::copyMakeBorder(band, padded, demosaic_margin - top, demosaic_margin - bottom, 0, 0, cv::BORDER_REFLECT_101);
        return padded;
    }

    std::filesystem::path path_;
    FrameRecord record_;
    PixelFormat format_;
    int next_ = 0;
};

class ImportedRows : public FrameRows {
public:
    explicit ImportedRows(const std::filesystem::path& path) : picture_(open_picture_rows(path)) {}

    cv::Size size() const override { return picture_->size(); }
    int type() const override { return picture_->type(); }

    void read(int rows, cv::Mat& samples) override {
        samples.create(rows, size().width, type());
        picture_->read(samples);
    }

private:
    std::unique_ptr<PictureRows> picture_;
};

}  // namespace

bool is_captured(const FrameRecord& frame) { return pixel_format_from_name(frame.format).has_value(); }

std::unique_ptr<FrameRows> open_frame_rows(const Session& session, const FrameRecord& frame) {
    if (is_captured(frame)) return std::make_unique<CapturedRows>(session, frame);
    return std::make_unique<ImportedRows>(session.path_of(frame));
}

}  // namespace darkbox
