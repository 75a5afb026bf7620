#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/formats/row_store.h"
#include "processing/maps/lights.h"
#include "processing/normals/sample_use.h"

namespace darkbox {

/// How one photograph's samples were used, as shares of the pixels that have a normal.
struct SampleShares {
    std::string file;  ///< the photograph
    double kept = 0;
    double shadow = 0;
    double highlight = 0;
    double clipped = 0;
};

/// Keeps the uses of all samples on disk, two bits each, until the normals are final, then writes one grey picture for
/// each used photograph. Thread-safe as its base says.
class SampleUses : public SampleUseSink {
public:
    /// The store lies in `folder`. Throws InputError where the disk has no room for it.
    SampleUses(std::filesystem::path folder, cv::Size size, std::size_t photographs);

    void take(int row, std::size_t photograph, std::span<const SampleUse> uses) override;
    /// FOLDER/NAME.png for each used light's photograph, 8 bits of grey as SampleUse numbers them; pixels that are not
    /// `valid` are no_normal.
    std::vector<SampleShares> write(const Lights& lights, const cv::Mat1b& valid, const WorkContext& work);

private:
    using Counts = std::array<std::size_t, 4>;

    std::size_t place(int row, std::size_t photograph) const;
    Counts write_picture(const std::filesystem::path& file, std::size_t photograph, const cv::Mat1b& valid) const;

    std::filesystem::path folder_;
    cv::Size size_;
    RowStore store_;
};

}  // namespace darkbox
