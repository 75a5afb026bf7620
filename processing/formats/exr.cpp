#include "processing/formats/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <mutex>
#include <string_view>

#include "processing/formats/atomic_file.h"
#include "processing/formats/exr_codec.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr int longest_side = 1 << 17;
constexpr std::uint64_t most_pixels = 512'000'000;

/// Lets the library read from memory.
class MemoryStream : public Imf::IStream {
public:
    MemoryStream(Bytes bytes, const std::string& file) : Imf::IStream(file.c_str()), bytes_(bytes) {}

    bool read(char out[], int count) override {
        const auto wanted = static_cast<std::size_t>(count);
        if (wanted > bytes_.size() - position_) throw std::runtime_error("end of file");
        std::memcpy(out, bytes_.data() + position_, wanted);
        position_ += wanted;
        return position_ < bytes_.size();
    }
    uint64_t tellg() override { return position_; }
    void seekg(uint64_t position) override {
        if (position > bytes_.size()) throw std::runtime_error("end of file");
        position_ = position;
    }

private:
    Bytes bytes_;
    std::size_t position_ = 0;
};

/// Lets the library write to a file. It drops errors of what it writes at its very end; they are kept here.
class FileStream : public Imf::OStream {
public:
    FileStream(AtomicFile& file, const std::string& name) : Imf::OStream(name.c_str()), file_(file) {}

    void write(const char bytes[], int count) override {
        try {
            file_.write(std::string_view(bytes, static_cast<std::size_t>(count)));
        } catch (...) {
            failure_ = std::current_exception();
            throw;
        }
        position_ += static_cast<std::uint64_t>(count);
    }
    uint64_t tellp() override { return position_; }
    void seekp(uint64_t position) override {
        file_.seek(position);
        position_ = position;
    }
    void rethrow_failure() const {
        if (failure_) std::rethrow_exception(failure_);
    }

private:
    AtomicFile& file_;
    std::uint64_t position_ = 0;
    std::exception_ptr failure_;
};

Imf::Slice slice_of(cv::Mat1f& values, const Imath::Box2i& window) {
    const auto row = static_cast<std::size_t>(values.cols) * sizeof(float);
    return Imf::Slice::Make(Imf::FLOAT, values.ptr(), window.min, values.cols, values.rows, sizeof(float), row);
}

std::vector<ExrChannel> read_channels(Imf::InputFile& input, const std::string& file, std::uint64_t limit) {
    const Imath::Box2i window = input.header().dataWindow();
    const auto width = static_cast<std::uint64_t>(window.max.x - window.min.x + 1);
    const auto height = static_cast<std::uint64_t>(window.max.y - window.min.y + 1);
    if (width * height > limit)
        throw bad_picture(file, fmt::format("claims {}x{} pixels, too many to read", width, height));
    std::vector<ExrChannel> channels;
    Imf::FrameBuffer buffer;
    for (auto it = input.header().channels().begin(); it != input.header().channels().end(); ++it) {
        if (it.channel().xSampling != 1 || it.channel().ySampling != 1) continue;  // chroma at half size
        channels.push_back({it.name(), cv::Mat1f(static_cast<int>(height), static_cast<int>(width))});
        buffer.insert(it.name(), slice_of(channels.back().values, window));
    }
    input.setFrameBuffer(buffer);
    input.readPixels(window.min.y, window.max.y);
    return channels;
}

const cv::Mat1f* find(const std::vector<ExrChannel>& channels, const std::string& name) {
    const auto found =
        std::find_if(channels.begin(), channels.end(), [&](const ExrChannel& c) { return c.name == name; });
    return found == channels.end() ? nullptr : &found->values;
}

void require_alike(const std::vector<ExrChannel>& channels, const fs::path& path) {
    for (const ExrChannel& channel : channels)
        if (channel.values.empty() || channel.values.size() != channels.front().values.size())
            throw InputError(fmt::format("channel {} of {} is empty or of another size", channel.name, path.string()),
                             "report this as a bug");
}

}  // namespace

void limit_exr_library() {
    static std::once_flag once;
    std::call_once(once, [] { Imf::Header::setMaxImageSize(longest_side, longest_side); });
}

std::vector<ExrChannel> decode_exr(Bytes bytes, const std::string& file, std::uint64_t limit) {
    limit_exr_library();
    try {
        MemoryStream stream(bytes, file);
        Imf::InputFile input(stream, 1);
        return read_channels(input, file, limit);
    } catch (const InputError&) {
        throw;
    } catch (const std::exception& error) {
        throw bad_picture(file, fmt::format("is damaged or cut short: {}", error.what()));
    }
}

cv::Mat3f colour_of(const std::vector<ExrChannel>& channels, const std::string& file) {
    const cv::Mat1f* grey = find(channels, "Y");
    const cv::Mat1f* red = find(channels, "R");
    const cv::Mat1f* green = find(channels, "G");
    const cv::Mat1f* blue = find(channels, "B");
    const bool colour = red && green && blue;
    if (!colour && !grey) throw bad_picture(file, "has neither R, G, B nor Y channels");
    cv::Mat3f image;
    cv::merge(colour ? std::vector<cv::Mat>{*red, *green, *blue} : std::vector<cv::Mat>{*grey, *grey, *grey}, image);
    return image;
}

void write_exr_rows(const fs::path& path, cv::Size size, const std::vector<std::string>& channels,
                    const FillExrRow& fill) {
    if (channels.empty() || size.empty())
        throw InputError(fmt::format("{} would have no channels or no pixels", path.string()), "report this as a bug");
    Imf::Header header(size.width, size.height);
    header.compression() = Imf::RLE_COMPRESSION;
    std::vector<float> samples(channels.size() * static_cast<std::size_t>(size.width));
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < channels.size(); ++c) {
        header.channels().insert(channels[c], Imf::Channel(Imf::FLOAT));
        constexpr std::size_t same_place_for_all_rows = 0;
        buffer.insert(channels[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(samples.data() + c),
                                              channels.size() * sizeof(float), same_place_for_all_rows));
    }
    AtomicFile file(path);
    FileStream stream(file, path.string());
    {
        Imf::OutputFile output(stream, header, 0);
        output.setFrameBuffer(buffer);
        for (int row = 0; row < size.height; ++row) {
            fill(row, samples.data());
            output.writePixels(1);
        }
    }
    stream.rethrow_failure();
    file.commit();
}

void write_exr(const fs::path& path, const std::vector<ExrChannel>& channels) {
    if (channels.empty())
        throw InputError(fmt::format("{} would have no channels", path.string()), "report this as a bug");
    require_alike(channels, path);
    std::vector<std::string> names;
    for (const ExrChannel& channel : channels) names.push_back(channel.name);
    const cv::Size size = channels.front().values.size();
    write_exr_rows(path, size, names, [&](int row, float* samples) {
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const float* values = channels[c].values[row];
            float* to = samples + c;
            for (int x = 0; x < size.width; ++x, to += channels.size()) *to = values[x];
        }
    });
}

void write_exr(const fs::path& path, const cv::Mat3f& image) {
    write_exr_rows(path, image.size(), {"R", "G", "B"}, [&](int row, float* samples) {
        std::copy_n(image[row]->val, std::ptrdiff_t{3} * image.cols, samples);
    });
}

void write_exr(const fs::path& path, const cv::Mat1f& image) { write_exr(path, std::vector<ExrChannel>{{"Y", image}}); }

std::optional<cv::Mat1f> find_exr_channel(const fs::path& path, const std::string& channel) {
    const auto channels = decode_exr(read_file(path), path.string(), most_pixels);
    const cv::Mat1f* found = find(channels, channel);
    return found ? std::optional(*found) : std::nullopt;
}

cv::Mat1f read_exr_channel(const fs::path& path, const std::string& channel) {
    const std::optional<cv::Mat1f> found = find_exr_channel(path, channel);
    if (!found) throw bad_picture(path.string(), fmt::format("has no channel {}", channel));
    return *found;
}

std::vector<ExrChannel> read_exr_channels(const fs::path& path) {
    std::vector<ExrChannel> channels = decode_exr(read_file(path), path.string(), most_pixels);
    if (channels.empty()) throw bad_picture(path.string(), "has no channel of full size");
    return channels;
}

cv::Mat3f read_exr_colour(const fs::path& path) {
    return colour_of(decode_exr(read_file(path), path.string(), most_pixels), path.string());
}

}  // namespace darkbox
