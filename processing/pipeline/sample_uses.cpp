#include "processing/pipeline/sample_uses.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "processing/formats/png.h"
#include "processing/maps/parallel.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::array<SampleUse, 4> codes{SampleUse::shadow, SampleUse::clipped, SampleUse::highlight, SampleUse::kept};

std::size_t code_of(SampleUse use) {
    const auto found = std::find(codes.begin(), codes.end(), use);
    return found == codes.end() ? 0 : static_cast<std::size_t>(found - codes.begin());
}

/// After the photographs, which may differ by their extension alone.
std::vector<std::string> picture_names(const Lights& lights) {
    std::set<std::string> taken;
    std::vector<std::string> names;
    for (const Light& light : lights) {
        const fs::path photograph = fs::path(light.file).filename();
        names.push_back(photograph.stem().string() + ".png");
        if (!taken.insert(names.back()).second) names.back() = photograph.string() + ".png";
    }
    return names;
}

}  // namespace

SampleUses::SampleUses(fs::path folder, cv::Size size, std::size_t photographs)
    : folder_(std::move(folder)),
      size_(size),
      store_(folder_.parent_path(), photographs * static_cast<std::size_t>(size.height),
             static_cast<std::size_t>(size.width + 3) / 4) {}

std::size_t SampleUses::place(int row, std::size_t photograph) const {
    return photograph * static_cast<std::size_t>(size_.height) + static_cast<std::size_t>(row);
}

void SampleUses::take(int row, std::size_t photograph, std::span<const SampleUse> uses) {
    std::vector<std::byte> packed(store_.bytes_per_row());
    for (std::size_t x = 0; x < uses.size(); ++x)
        packed[x / 4] |= static_cast<std::byte>(code_of(uses[x]) << (2 * (x % 4)));
    store_.write(place(row, photograph), packed);
}

SampleUses::Counts SampleUses::write_picture(const fs::path& file, std::size_t photograph,
                                             const cv::Mat1b& valid) const {
    Counts counts{};
    std::vector<std::byte> packed(store_.bytes_per_row());
    write_png_rows(file, size_, CV_8UC1, [&](int row, uchar* samples) {
        store_.read(place(row, photograph), packed);
        for (int x = 0; x < size_.width; ++x) {
            const auto code = static_cast<std::size_t>(packed[static_cast<std::size_t>(x / 4)] >> (2 * (x % 4))) & 3U;
            const bool has_normal = valid(row, x) != 0;
            samples[x] = static_cast<uchar>(has_normal ? codes[code] : SampleUse::no_normal);
            counts[code] += has_normal ? 1 : 0;
        }
    });
    return counts;
}

std::vector<SampleShares> SampleUses::write(const Lights& lights, const cv::Mat1b& valid, const WorkContext& work) {
    const std::vector<std::string> names = picture_names(lights);
    std::vector<SampleShares> shares(lights.size());
    on_threads_of(work, [&] {
        tbb::parallel_for(std::size_t{0}, lights.size(), [&](std::size_t i) {
            if (!lights[i].used) return;
            const Counts counts = write_picture(folder_ / names[i], i, valid);
            const auto pixels = static_cast<double>(
                std::max<std::size_t>(std::accumulate(counts.begin(), counts.end(), std::size_t{0}), 1));
            const auto share = [&](SampleUse use) { return static_cast<double>(counts[code_of(use)]) / pixels; };
            shares[i] = {lights[i].file, share(SampleUse::kept), share(SampleUse::shadow), share(SampleUse::highlight),
                         share(SampleUse::clipped)};
        });
    });
    std::erase_if(shares, [](const SampleShares& one) { return one.file.empty(); });
    return shares;
}

}  // namespace darkbox
