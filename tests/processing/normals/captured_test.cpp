// Photometric stereo on real photographs with known truth.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/normals/photometric_stereo.h"
#include "tests/support/test_data.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// A linear photograph, 1.0 = full scale of its bit depth.
cv::Mat3f read_photograph(const fs::path& path) {
    const cv::Mat coded = cv::imread(path.string(), cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
    if (coded.empty()) throw std::runtime_error("cannot read " + path.string());
    cv::Mat3f image;
    coded.convertTo(image, CV_32F, coded.depth() == CV_16U ? 1 / 65535.0 : 1 / 255.0);
    cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
    return image;
}

cv::Mat1b read_mask(const fs::path& path) { return cv::Mat1b(cv::imread(path.string(), cv::IMREAD_GRAYSCALE) > 127); }

std::vector<Eigen::Vector3d> read_rows(const fs::path& path) {
    std::ifstream in(path);
    std::vector<Eigen::Vector3d> rows;
    for (Eigen::Vector3d v; in >> v[0] >> v[1] >> v[2];) rows.push_back(v);
    return rows;
}

void add_photograph(PhotoStack& stack, const fs::path& path) {
    stack.images.push_back(read_photograph(path));
    std::array<cv::Mat1f, 3> channels;
    cv::split(stack.images.back(), channels.data());
    stack.clipped.emplace_back(cv::max(cv::max(channels[0], channels[1]), channels[2]) >= 1.0);
    stack.files.push_back(path.filename().string());
}

cv::Mat3d read_true_normals(const fs::path& path) {
    mat_t* file = Mat_Open(path.c_str(), MAT_ACC_RDONLY);
    matvar_t* variable = Mat_VarRead(file, "Normal_gt");
    const int rows = static_cast<int>(variable->dims[0]), cols = static_cast<int>(variable->dims[1]);
    const auto* data = static_cast<const double*>(variable->data);
    cv::Mat3d normals(rows, cols);
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < cols; ++c)
            for (int k = 0; k < 3; ++k) normals(r, c)[k] = data[(k * cols + c) * rows + r];
    Mat_VarFree(variable);
    Mat_Close(file);
    return normals;
}

struct DiligentBall {
    explicit DiligentBall(const fs::path& folder) : truth(read_true_normals(folder / "Normal_gt.mat")) {
        const auto directions = read_rows(folder / "light_directions.txt");
        const auto intensities = read_rows(folder / "light_intensities.txt");
        stack.mask = read_mask(folder / "mask.png");
        for (std::size_t i = 0; i < directions.size(); ++i) {
            add_photograph(stack, folder / fmt::format("{:03}.png", i + 1));
            lights.push_back({stack.files.back(), directions[i], intensities[i]});
        }
    }

    /// Over all of the mask.
    double mean_error_deg(const PhotometricStereoResult& result) const {
        double sum = 0;
        for (int r = 0; r < truth.rows; ++r)
            for (int c = 0; c < truth.cols; ++c) {
                if (stack.mask(r, c) == 0) continue;
                const cv::Vec3f& n = result.normals.normal(r, c);
                const cv::Vec3d& t = truth(r, c);
                sum += result.normals.valid(r, c) ? angle_deg({n[0], n[1], n[2]}, {t[0], t[1], t[2]}) : 90.0;
            }
        return sum / cv::countNonZero(stack.mask);
    }

    PhotoStack stack;
    Lights lights;
    cv::Mat3d truth;
};

TEST(CapturedDiligentBall, SolversReachThePublishedErrors) {
    DARKBOX_NEED_DATA(folder, "diligent_ball");
    const DiligentBall ball(folder);
    const double mean = ball.mean_error_deg(photometric_stereo(ball.stack, ball.lights));
    EXPECT_LE(mean, 4.2);
    EXPECT_GT(mean, 3.6) << "least squares cannot be this good: is the truth being read?";
    PhotometricStereoOptions options;
    options.solver = Solver::robust;
    const auto robust = photometric_stereo(ball.stack, ball.lights, options);
    fmt::print("diligent_ball: least squares {:.3f}, robust {:.3f} degrees mean\n", mean, ball.mean_error_deg(robust));
    EXPECT_LE(ball.mean_error_deg(robust), 1.33);
    EXPECT_EQ(robust.model.law.kind, BodyKind::smooth);
}

TEST(CapturedGrayBall, ResidualIsThatOfTheReferenceLights) {
    DARKBOX_NEED_DATA(folder, "psm");
    std::ifstream in(folder / "lights_reference.txt");
    int n = 0;
    in >> n;
    PhotoStack stack;
    stack.mask = read_mask(folder / "gray/mask.png");
    Lights lights;
    for (int i = 0; i < n; ++i) {
        add_photograph(stack, folder / fmt::format("gray/gray.{:02}.png", i));
        Light light;
        light.file = stack.files.back();
        in >> light.direction[0] >> light.direction[1] >> light.direction[2];
        lights.push_back(light);
    }
    const auto result = photometric_stereo(stack, lights);
    double absolute = 0, intensity = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const cv::Mat1f mean = mean_channel(stack.images[i]);
        for (int r = 0; r < mean.rows; ++r)
            for (int c = 0; c < mean.cols; ++c) {
                if (!result.normals.valid(r, c)) continue;
                const cv::Vec3f& normal = result.normals.normal(r, c);
                const cv::Vec3f& rgb = result.albedo.albedo(r, c);
                const double shading = Eigen::Vector3d(normal[0], normal[1], normal[2]).dot(lights[i].direction);
                absolute += std::abs(mean(r, c) - (rgb[0] + rgb[1] + rgb[2]) / 3.0 * shading);
                intensity += mean(r, c);
            }
    }
    fmt::print("gray ball: mean absolute residual {:.2f} % of mean intensity\n", 100 * absolute / intensity);
    EXPECT_NEAR(absolute / intensity, 0.028, 0.002);
}

}  // namespace
}  // namespace darkbox
