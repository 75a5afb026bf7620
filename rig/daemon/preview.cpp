#include "rig/daemon/preview.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/frame_file.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/session_json.h"
#include "processing/formats/jpeg_writer.h"
#include "processing/maps/srgb.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_journal = 256 * 1024 * 1024;  ///< bytes
constexpr int jpeg_quality = 80;

/// The last whole line that acknowledges a frame.
std::optional<FrameRecord> last_in_journal(const fs::path& session) {
    std::string text = read_text(session / journal_name, longest_journal);
    text.resize(text.rfind('\n') == text.npos ? 0 : text.rfind('\n'));  // what follows was never acknowledged
    while (text.find('\n') != text.npos) {                              // the first line is the head
        const std::size_t start = text.rfind('\n') + 1;
        const JournalEntry entry = parse_journal_line("journal", std::string_view(text).substr(start));
        if (const auto* frame = std::get_if<FrameEntry>(&entry)) return frame->record;
        text.resize(start - 1);
    }
    return std::nullopt;
}

std::optional<FrameRecord> last_in_bag(const fs::path& folder) {
    const Session session = Session::open(folder);
    if (session.frames().empty()) return std::nullopt;
    return session.frames().back();
}

std::optional<FrameRecord> last_frame_of(const fs::path& folder) {
    if (is_sealed(folder)) return last_in_bag(folder);
    if (!fs::exists(folder / journal_name)) return std::nullopt;
    try {
        return last_in_journal(folder);
    } catch (const Error&) {
        if (!is_sealed(folder)) throw;
        return last_in_bag(folder);  // it was sealed at this very moment
    }
}

/// One sample of a Frame as a share of full scale.
class Samples {
public:
    explicit Samples(const Frame& frame)
        : frame_(frame),
          wide_(bytes_per_sample(frame.format) == 2),
          full_(static_cast<float>((1 << frame.bit_depth) - 1)),
          black_(static_cast<float>(frame.black_level)) {}

    float at(int row, int column, int channel, int channels) const {
        const auto place = (static_cast<std::size_t>(row) * static_cast<std::size_t>(frame_.width) +
                            static_cast<std::size_t>(column)) *
                               static_cast<std::size_t>(channels) +
                           static_cast<std::size_t>(channel);
        const auto byte = [&](std::size_t i) { return std::to_integer<int>(frame_.pixels[i]); };
        const int value = wide_ ? byte(2 * place) | byte(2 * place + 1) << 8 : byte(place);
        return std::max(0.0F, (static_cast<float>(value) - black_) / (full_ - black_));
    }

private:
    const Frame& frame_;
    bool wide_;
    float full_, black_;
};

cv::Vec3f colour_at(const Frame& frame, const Samples& samples, int row, int column) {
    if (const auto pattern = mosaic(frame.format)) {
        const int r = row & ~1;
        const int c = column & ~1;
        const auto at = [&](int dr, int dc) { return samples.at(r + dr, c + dc, 0, 1); };
        return {at(pattern->red_row, pattern->red_column), at(pattern->red_row, 1 - pattern->red_column),
                at(1 - pattern->red_row, 1 - pattern->red_column)};
    }
    const int n = channels(frame.format);
    if (n == 3) return {samples.at(row, column, 0, 3), samples.at(row, column, 1, 3), samples.at(row, column, 2, 3)};
    const float luma = samples.at(row, column, 0, frame.format == PixelFormat::ycc8 ? 2 : 1);
    return {luma, luma, luma};
}

/// Every so-many-th pixel: it is to be seen now, not kept.
cv::Mat3f decimated(const Frame& frame) {
    const int step = std::max(1, (std::max(frame.width, frame.height) + preview_side - 1) / preview_side);
    const Samples samples(frame);
    cv::Mat3f small(std::max(1, frame.height / step), std::max(1, frame.width / step));
    const int last_row = std::max(0, frame.height - 2);
    const int last_column = std::max(0, frame.width - 2);
    for (int row = 0; row < small.rows; ++row)
        for (int column = 0; column < small.cols; ++column)
            small(row, column) =
                colour_at(frame, samples, std::min(row * step, last_row), std::min(column * step, last_column));
    return small;
}

std::string jpeg_of(const cv::Mat3f& linear) {
    constexpr double most_gain = 20;  // a dark frame is to look dark
    const double gain = std::min(most_gain, viewing_gain(linear, cv::Mat1b(linear.size(), 255)));
    const std::vector<std::byte> bytes = encode_jpeg(viewable(linear, gain), jpeg_quality);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::optional<LatestFrame> Preview::latest(const fs::path& session) {
    const auto record = last_frame_of(session);
    if (!record || !pixel_format_from_name(record->format)) return std::nullopt;
    const std::unique_lock lock(mutex_);
    if (session == session_ && record->file == made_.file && record->sha256 == sha256_) return made_;
    const fs::path file = plain_file_inside(session / "data", record->file);
    made_ = {.file = record->file, .lamp = record->lamp_name, .bytes = jpeg_of(decimated(read_frame(file, *record)))};
    session_ = session;
    sha256_ = record->sha256;
    return made_;
}

}  // namespace darkbox
