#include "processing/maps/maps.h"

#include <fmt/format.h>

#include "acquisition/frame/error.h"

namespace darkbox {

void require_consistent(const PhotoStack& stack) {
    if (stack.images.empty())
        throw InputError("there are no photographs", "give a session with at least three lit frames");
    if (stack.clipped.size() != stack.images.size() || stack.files.size() != stack.images.size())
        throw InputError("the photographs, their clipping masks and their names differ in number",
                         "report this as a bug");
    for (std::size_t i = 0; i < stack.images.size(); ++i)
        if (stack.images[i].size() != stack.mask.size() || stack.clipped[i].size() != stack.mask.size())
            throw InputError(fmt::format("{} is {}x{} pixels but the mask is {}x{}", stack.files[i],
                                         stack.images[i].cols, stack.images[i].rows, stack.mask.cols, stack.mask.rows),
                             "give photographs and a mask of one size");
}

cv::Mat1f mean_channel(const cv::Mat3f& image) {
    cv::Mat1f mean(image.size());
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            const cv::Vec3f& p = image(y, x);
            mean(y, x) = (p[0] + p[1] + p[2]) / 3.0F;
        }
    return mean;
}

}  // namespace darkbox
