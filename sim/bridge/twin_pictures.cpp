#include "sim/bridge/twin_pictures.h"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "acquisition/device/device_error.h"
#include "acquisition/frame/error.h"
#include "sim/renderer.h"

namespace darkbox::sim {
namespace {

constexpr std::array<char, 8> magic{'t', 'w', 'i', 'n', '-', '1', '\n', '\0'};
constexpr int largest_side = 8192, most_lamps = 64;

struct Head {
    std::array<char, 8> magic{};
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::int32_t lamps = 0;
};

std::vector<float> mean_of_colours(const RgbImage& image) {
    std::vector<float> grey(image.samples.size() / 3);
    for (std::size_t i = 0; i < grey.size(); ++i)
        grey[i] = (image.samples[3 * i] + image.samples[3 * i + 1] + image.samples[3 * i + 2]) / 3;
    return grey;
}

std::streamsize bytes_of(const std::vector<float>& samples) {
    return static_cast<std::streamsize>(samples.size() * sizeof(float));
}

}  // namespace

TwinPictures::TwinPictures(const Scene& scene) : width_(scene.view.width), height_(scene.view.height) {
    std::vector<LampId> all(scene.lamps.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i].value = static_cast<std::uint32_t>(i);
    for (const RgbImage& image : Renderer(scene).render(all)) radiance_.push_back(mean_of_colours(image));
}

TwinPictures::TwinPictures(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    Head head;
    in.read(reinterpret_cast<char*>(&head), sizeof head);
    const auto sound = [](std::int32_t value, int most) { return value >= 1 && value <= most; };
    const bool known = in && head.magic == magic && sound(head.width, largest_side) &&
                       sound(head.height, largest_side) && sound(head.lamps, most_lamps);
    if (known) {
        width_ = head.width;
        height_ = head.height;
        const auto pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
        radiance_.assign(static_cast<std::size_t>(head.lamps), std::vector<float>(pixels));
        for (std::vector<float>& samples : radiance_)
            in.read(reinterpret_cast<char*>(samples.data()), bytes_of(samples));
    }
    if (!known || !in)
        throw InputError(fmt::format("{} holds no pictures of the twin", file.string()),
                         "make it with twin_camera render");
}

void TwinPictures::write(const std::filesystem::path& file) const {
    std::ofstream out(file, std::ios::binary);
    const Head head{magic, width_, height_, static_cast<std::int32_t>(radiance_.size())};
    out.write(reinterpret_cast<const char*>(&head), sizeof head);
    for (const std::vector<float>& samples : radiance_)
        out.write(reinterpret_cast<const char*>(samples.data()), bytes_of(samples));
    out.flush();
    if (!out) throw DeviceError(fmt::format("cannot write {}", file.string()), "check the folder and the free space");
}

std::vector<std::uint16_t> TwinPictures::expose(const Sensor& sensor, const std::vector<double>& shares,
                                                const ExposureSetting& setting) const {
    std::vector<float> light(radiance_.front().size());
    for (std::size_t lamp = 0; lamp < radiance_.size(); ++lamp) {
        if (shares.at(lamp) <= 0.0) continue;
        const auto share = static_cast<float>(shares[lamp]);
        for (std::size_t i = 0; i < light.size(); ++i) light[i] += share * radiance_[lamp][i];
    }
    return sim::expose(sensor, light, setting);
}

}  // namespace darkbox::sim
