#include "processing/pipeline/ball_focus.h"

#include <opencv2/imgproc.hpp>

#include "acquisition/frame/error.h"
#include "processing/calibration/reblur.h"
#include "processing/formats/json_file.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

constexpr double around = 1.25;          ///< of the ball's radius is looked at
constexpr std::size_t fewest_edges = 6;  ///< pixels: a sharp ball of some thirty pixels has few strong ones
constexpr float unclipped = 0.95F;       ///< of full scale

cv::Rect part_around(const Ball& ball, const cv::Size& size) {
    const double reach = around * ball.radius;
    const cv::Rect wanted(cvRound(ball.x - reach), cvRound(ball.y - reach), cvRound(2 * reach) + 1,
                          cvRound(2 * reach) + 1);
    return wanted & cv::Rect({0, 0}, size);
}

}  // namespace

std::optional<double> ball_blur_px(BallPhotographs& photographs, const std::vector<Ball>& balls) {
    if (photographs.count() == 0 || balls.empty()) return std::nullopt;
    const cv::Rect part = part_around(balls.front(), photographs.size());
    if (part.empty()) return std::nullopt;
    const std::vector<cv::Mat3f> frames = photographs.parts({part}).front();
    cv::Mat1f mean(part.size(), 0.0F);
    cv::Mat1b good(part.size(), uchar{255});
    for (const cv::Mat3f& frame : frames) {
        for (int v = 0; v < part.height; ++v)
            for (int u = 0; u < part.width; ++u) {
                const cv::Vec3f& pixel = frame(v, u);
                mean(v, u) += (pixel[0] + pixel[1] + pixel[2]) / (3.0F * static_cast<float>(frames.size()));
                if (pixel[0] > unclipped || pixel[1] > unclipped || pixel[2] > unclipped) good(v, u) = 0;
            }
    }
    return edge_width_px(mean, good, fewest_edges);
}

std::optional<double> stored_blur_px(const std::filesystem::path& session) {
    const std::filesystem::path file = ResultFiles(session).calibration_summary;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) return std::nullopt;
    try {
        const auto json = read_json(file);
        if (json.is_object() && json.contains("blur_px") && json.at("blur_px").is_number())
            return json.at("blur_px").get<double>();
    } catch (const InputError&) {  // calibrating again mends it
        return std::nullopt;
    }
    return std::nullopt;
}

}  // namespace darkbox
