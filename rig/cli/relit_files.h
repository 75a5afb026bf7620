#pragma once

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "processing/relight/relighter.h"

namespace darkbox {

/// What lights one picture.
using Lighting = std::variant<Lights, FoldedEnvironment, ConstantCoefficient>;

struct PictureStyle {
    double gain = 1;  ///< from radiance to what is looked at; EXR holds radiance
    int bits = 8;     ///< of a PNG: 8 or 16
};

/// Throws InputError for a name that does not end as a picture darkbox writes (.png, .jpg or .exr), and says how to
/// make a video where it ends as one.
void require_picture_name(const std::filesystem::path& path);

/// Names of `count` pictures. One picture is `out` itself; several are `out` with a number from 1 on in place of its
/// %d or %04d, or OUT/0001.png where `out` has no ending. Throws InputError for a single picture's name, and as
/// require_picture_name() does.
std::vector<std::filesystem::path> picture_names(const std::filesystem::path& out, std::size_t count);

/// Renders into what the file holds: EXR float radiance; PNG and JPEG sRGB after the gain. Returns the seconds of the
/// rendering alone.
double render_to_file(const Relighter& relighter, const Lighting& lighting, const RelightOptions& options,
                      const PictureStyle& style, const std::filesystem::path& path, const WorkContext& work);

/// The gain under which what the environment lights inside `object` just fills the range that can be seen: probes come
/// in any unit. The options' exposure counts on top of it.
double gain_under(const FoldedEnvironment& environment, const Relighter& relighter, RelightOptions options,
                  const cv::Mat1b& object, const WorkContext& work);

}  // namespace darkbox
