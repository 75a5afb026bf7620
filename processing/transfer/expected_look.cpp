#include "processing/transfer/expected_look.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr int cells_per_unit = 240;
constexpr int table_side = 2 * cells_per_unit + 33;
constexpr double blur_cells = 6;
/// Source pixels that a cell needs behind it, in the Gaussian's own weight.
constexpr float least_weight = 1e-3F;

/// Rows down, as in a picture of a sphere.
cv::Point cell_of(const cv::Vec3f& normal) {
    const auto place = [](float v) {
        return std::clamp(cvRound(v * cells_per_unit) + table_side / 2, 0, table_side - 1);
    };
    return {place(normal[0]), place(-normal[1])};
}

template <class Table>
void blur(Table& table) {
    cv::GaussianBlur(table, table, cv::Size(), blur_cells, blur_cells, cv::BORDER_CONSTANT);
}

template <class Visit>
void for_each_pixel(const cv::Mat1b& valid, const Visit& visit) {
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) visit(cv::Point(x, y));
}

cv::Mat1f empty_table() { return cv::Mat1f(table_side, table_side, 0.0F); }

}  // namespace

cv::Mat1f squared_laplacian(const cv::Mat3b& picture) {
    cv::Mat3f second;
    cv::Laplacian(picture, second, CV_32F);
    cv::Mat1f result(picture.size());
    for (int y = 0; y < picture.rows; ++y)
        for (int x = 0; x < picture.cols; ++x) result(y, x) = second(y, x).dot(second(y, x)) / 3;
    return result;
}

ExpectedLook::ExpectedLook(const Appearance& source)
    : weight_(empty_table()),
      colour_(table_side, table_side, cv::Vec3f(0, 0, 0)),
      sharpness_weight_(empty_table()),
      sharpness_(empty_table()) {
    const cv::Mat1f laplacian = squared_laplacian(source.picture);
    for_each_pixel(source.normals.valid, [&](cv::Point p) {
        const cv::Point cell = cell_of(source.normals.normal(p));
        weight_(cell) += 1;
        colour_(cell) += cv::Vec3f(source.picture(p));
    });
    for_each_pixel(inner_pixels(source.normals.valid, 1), [&](cv::Point p) {
        const cv::Point cell = cell_of(source.normals.normal(p));
        sharpness_weight_(cell) += 1;
        sharpness_(cell) += laplacian(p);
    });
    blur(weight_);
    blur(colour_);
    blur(sharpness_weight_);
    blur(sharpness_);
}

bool ExpectedLook::knows(const cv::Vec3f& normal) const { return weight_(cell_of(normal)) >= least_weight; }

cv::Vec3f ExpectedLook::colour(const cv::Vec3f& normal) const {
    const cv::Point cell = cell_of(normal);
    return colour_(cell) * (1 / std::max(weight_(cell), least_weight));
}

float ExpectedLook::sharpness(const cv::Vec3f& normal) const {
    const cv::Point cell = cell_of(normal);
    return sharpness_(cell) / std::max(sharpness_weight_(cell), least_weight);
}

cv::Mat1f ExpectedLook::expected_use(const Appearance& source, const NormalMap& target) const {
    cv::Mat1f wanted = empty_table();
    for_each_pixel(target.valid, [&](cv::Point p) { wanted(cell_of(target.normal(p))) += 1; });
    blur(wanted);
    cv::Mat1f use(source.picture.size(), 0.0F);
    for_each_pixel(source.normals.valid, [&](cv::Point p) {
        const cv::Point cell = cell_of(source.normals.normal(p));
        use(p) = wanted(cell) / std::max(weight_(cell), least_weight);
    });
    return use;
}

}  // namespace darkbox
