#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "processing/formats/exr_codec.h"
#include "processing/formats/picture_header.h"
#include "processing/formats/row_decoders.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

InputError damaged(const std::string& file, const std::exception& error) {
    return bad_picture(file, fmt::format("is damaged or cut short: {}", error.what()));
}

cv::Size size_of(const Imf::InputFile& input) {
    const Imath::Box2i window = input.header().dataWindow();
    return {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
}

bool has_full_channel(const Imf::InputFile& input, const char* name) {
    const Imf::Channel* channel = input.header().channels().findChannel(name);
    return channel && channel->xSampling == 1 && channel->ySampling == 1;
}

class ExrRows : public PictureRows {
public:
    ExrRows(std::string file, std::unique_ptr<Imf::InputFile> input)
        : PictureRows(size_of(*input), CV_32FC3),
          file_(std::move(file)),
          input_(std::move(input)),
          colour_(has_full_channel(*input_, "R") && has_full_channel(*input_, "G") && has_full_channel(*input_, "B")) {
        if (!colour_ && !has_full_channel(*input_, "Y")) throw bad_picture(file_, "has neither R, G, B nor Y channels");
    }

    void read(cv::Mat& rows) override {
        const Imath::Box2i window = input_->header().dataWindow();
        const int first = window.min.y + next_;
        try {
            input_->setFrameBuffer(places_in(rows, {window.min.x, first}));
            input_->readPixels(first, first + rows.rows - 1);
        } catch (const std::exception& error) {
            throw damaged(file_, error);
        }
        if (!colour_) replicate(rows);
        require_finite(rows, next_, file_);
        next_ += rows.rows;
    }

private:
    /// Grey goes into the first channel.
    Imf::FrameBuffer places_in(cv::Mat& rows, const Imath::V2i& first_pixel) const {
        Imf::FrameBuffer buffer;
        const std::array<const char*, 3> names = colour_ ? std::array{"R", "G", "B"} : std::array{"Y", "", ""};
        for (std::size_t c = 0; c < (colour_ ? 3U : 1U); ++c)
            buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, rows.ptr<float>() + c, first_pixel, rows.cols,
                                                     rows.rows, rows.elemSize(), rows.step[0]));
        return buffer;
    }

    static void replicate(cv::Mat& rows) {
        for (int y = 0; y < rows.rows; ++y)
            for (int x = 0; x < rows.cols; ++x) rows.at<cv::Vec3f>(y, x) = cv::Vec3f::all(rows.at<cv::Vec3f>(y, x)[0]);
    }

    std::string file_;
    std::unique_ptr<Imf::InputFile> input_;
    bool colour_;
    int next_ = 0;
};

}  // namespace

std::unique_ptr<PictureRows> open_exr_rows(const fs::path& path) {
    open_for_reading(path);  // for its errors, which say more than the library's
    const std::string file = path.string();
    limit_exr_library();
    std::unique_ptr<Imf::InputFile> input;
    try {
        input = std::make_unique<Imf::InputFile>(path.c_str(), 0);
    } catch (const std::exception& error) {
        throw damaged(file, error);
    }
    const cv::Size size = size_of(*input);
    require_sane_size(static_cast<std::uint64_t>(size.width), static_cast<std::uint64_t>(size.height), file);
    return std::make_unique<ExrRows>(file, std::move(input));
}

}  // namespace darkbox
