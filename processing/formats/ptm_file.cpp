#include "processing/formats/ptm_file.h"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "processing/formats/atomic_file.h"
#include "processing/formats/quantise.h"

namespace darkbox {
namespace {

constexpr double white = 255.0;  // a viewer's sample

/// Biases are whole bytes in the file, so the scale leaves room for their rounding.
ByteRange range_with_whole_bias(const cv::Mat& coefficient) {
    const ValueRange range = range_of(coefficient);
    const double low = range.low * white, high = range.high * white;
    ByteRange bytes;
    bytes.scale = std::max((high - low) / 254.0, 1e-6);
    bytes.bias = std::round(-low / bytes.scale);
    return bytes;
}

std::string header(const Ptm& ptm, const std::vector<ByteRange>& ranges) {
    std::string text = fmt::format("PTM_1.2\nPTM_FORMAT_{}\n{}\n{}\n", ptm.model == PtmModel::rgb ? "RGB" : "LRGB",
                                   ptm.size().width, ptm.size().height);
    for (const ByteRange& range : ranges) text += fmt::format("{:.9g} ", range.scale);
    text += '\n';
    for (const ByteRange& range : ranges) text += fmt::format("{:.0f} ", range.bias);
    return text + '\n';
}

void write_coefficients(AtomicFile& file, const Ptm& ptm, const std::vector<ByteRange>& ranges, int channel) {
    const int channels = ptm.coefficient.front().channels();
    std::string row;
    for (int y = ptm.size().height - 1; y >= 0; --y) {
        row.clear();
        for (int x = 0; x < ptm.size().width; ++x)
            for (std::size_t t = 0; t < ptm_terms; ++t)
                row += static_cast<char>(ranges[t].byte(
                    white * static_cast<double>(ptm.coefficient[t].ptr<float>(y)[x * channels + channel])));
        file.write(row);
    }
}

void write_colours(AtomicFile& file, const cv::Mat3f& colour) {
    std::string row;
    for (int y = colour.rows - 1; y >= 0; --y) {
        row.clear();
        for (int x = 0; x < colour.cols; ++x)
            for (int c = 0; c < 3; ++c) row += static_cast<char>(cv::saturate_cast<uchar>(colour(y, x)[c] * 255.0F));
        file.write(row);
    }
}

}  // namespace

void write_ptm(const std::filesystem::path& path, const Ptm& ptm) {
    std::vector<ByteRange> ranges;
    for (const cv::Mat& coefficient : ptm.coefficient) ranges.push_back(range_with_whole_bias(coefficient));
    AtomicFile file(path);
    file.write(header(ptm, ranges));
    const int blocks = ptm.model == PtmModel::rgb ? 3 : 1;
    for (int channel = 0; channel < blocks; ++channel) write_coefficients(file, ptm, ranges, channel);
    if (ptm.model == PtmModel::lrgb) write_colours(file, ptm.colour);
    file.commit();
}

}  // namespace darkbox
