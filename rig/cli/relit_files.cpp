#include "rig/cli/relit_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "acquisition/frame/error.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/exr.h"
#include "processing/formats/jpeg_writer.h"
#include "processing/formats/png.h"
#include "processing/maps/srgb.h"
#include "processing/pipeline/steps.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr int jpeg_quality = 95;
constexpr std::size_t widest_number = 9;

bool ends_in(const fs::path& path, std::initializer_list<const char*> endings) {
    return std::find(endings.begin(), endings.end(), path.extension().string()) != endings.end();
}

/// The place of a %d or %0Nd in a name.
struct NumberPlace {
    std::size_t begin, length, digits;
};

std::optional<NumberPlace> find_number(const std::string& name) {
    const std::size_t begin = name.find('%');
    if (begin == std::string::npos) return std::nullopt;
    const std::size_t end = name.find_first_not_of("0123456789", begin + 1);
    std::size_t digits = 1;
    if (end == std::string::npos || name[end] != 'd' || name.find('%', end) != std::string::npos) return std::nullopt;
    if (end > begin + 1) std::from_chars(&name[begin + 1], &name[end], digits);
    if (digits == 0 || digits > widest_number) return std::nullopt;
    return NumberPlace{begin, end + 1 - begin, digits};
}

void write(const fs::path& path, const cv::Mat3b& image) {
    if (ends_in(path, {".png"}))
        write_png(path, image);
    else
        write_file(path, encode_jpeg(image, jpeg_quality));
}

}  // namespace

void require_picture_name(const fs::path& path) {
    if (ends_in(path, {".png", ".jpg", ".jpeg", ".exr"})) return;
    if (ends_in(path, {".mp4", ".avi", ".mkv", ".mov", ".webm", ".gif"}))
        throw InputError(
            fmt::format("'{}' is a video, and darkbox writes pictures", path.string()),
            fmt::format("give --out frames/%04d.png, then: ffmpeg -framerate 25 -i frames/%04d.png -pix_fmt yuv420p {}",
                        path.string()));
    throw InputError(fmt::format("'{}' is not a picture darkbox writes", path.string()),
                     "end the name in .png, .jpg or .exr (linear float)");
}

std::vector<fs::path> picture_names(const fs::path& out, std::size_t count) {
    const fs::path pattern = out.has_extension() ? out : out / "%04d.png";
    require_picture_name(pattern);
    if (count == 1 && out.has_extension() && !find_number(out.string())) return {out};
    const std::string text = pattern.string();
    const auto number = find_number(text);
    if (!number)
        throw InputError(fmt::format("'{}' is the name of one picture, but there are {}", out.string(), count),
                         "give a folder, or a name with a place for the number, such as frames/%04d.png");
    std::vector<fs::path> names;
    for (std::size_t i = 1; i <= count; ++i)
        names.emplace_back(text.substr(0, number->begin) + fmt::format("{:0{}}", i, number->digits) +
                           text.substr(number->begin + number->length));
    return names;
}

double render_to_file(const Relighter& relighter, const Lighting& lighting, const RelightOptions& options,
                      const PictureStyle& style, const fs::path& path, const WorkContext& work) {
    require_picture_name(path);
    const bool radiance = ends_in(path, {".exr"});
    cv::Mat3f floats;
    cv::Mat3b bytes;
    Stopwatch watch;
    if (radiance || (ends_in(path, {".png"}) && style.bits == 16)) {
        floats.create(relighter.size());
        std::visit([&](const auto& light) { relighter.render(light, options, floats, work); }, lighting);
    } else {
        RelightOptions viewed = options;
        viewed.exposure *= style.gain;
        bytes.create(relighter.size());
        std::visit([&](const auto& light) { relighter.render(light, viewed, Encoding::srgb, bytes, work); }, lighting);
    }
    const double seconds = watch.lap();
    if (!bytes.empty())
        write(path, bytes);
    else if (radiance)
        write_exr(path, floats);
    else
        write_png(path, viewable_16(floats, style.gain));
    return seconds;
}

double gain_under(const FoldedEnvironment& environment, const Relighter& relighter, RelightOptions options,
                  const cv::Mat1b& object, const WorkContext& work) {
    options.exposure = 1;
    cv::Mat3f picture(relighter.size());
    relighter.render(environment, options, picture, work);
    return viewing_gain(picture, object);
}

}  // namespace darkbox
