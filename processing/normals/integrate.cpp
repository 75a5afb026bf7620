#include "processing/normals/integrate.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <vector>

#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr float steepest = 0.05F;              // least n_z: 87 degrees; beyond it the slope is noise
constexpr double anchor = 1e-8;                // makes each connected part's mean height 0 instead of anything
constexpr int most_direct_unknowns = 400'000;  // a direct solution of more takes gigabytes
constexpr int most_iterations = 400;
constexpr double tolerance = 1e-6;

/// The normal equations of all height differences between valid neighbours.
struct Equations {
    Sparse matrix;
    Eigen::VectorXd right;
    cv::Mat1i unknown;  ///< by pixel, -1 where not valid
};

double slope_right(const cv::Vec3f& n) { return -n[0] / std::max(n[2], steepest); }
double slope_down(const cv::Vec3f& n) { return n[1] / std::max(n[2], steepest); }

cv::Mat1i number_pixels(const cv::Mat1b& valid) {
    cv::Mat1i number(valid.size(), -1);
    int count = 0;
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) number(y, x) = count++;
    return number;
}

Equations equations_of(const NormalMap& map) {
    Equations e{{}, {}, number_pixels(map.valid)};
    const int count = cv::countNonZero(map.valid);
    e.right = Eigen::VectorXd::Zero(count);
    std::vector<Eigen::Triplet<double>> terms;
    terms.reserve(static_cast<std::size_t>(count) * 5);
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(count, anchor);
    const auto difference = [&](int a, int b, double rise) {  // z_b - z_a = rise
        diagonal[a] += 1;
        diagonal[b] += 1;
        terms.emplace_back(std::max(a, b), std::min(a, b), -1.0);  // lower triangle
        e.right[a] -= rise;
        e.right[b] += rise;
    };
    for (int y = 0; y < map.valid.rows; ++y)
        for (int x = 0; x < map.valid.cols; ++x) {
            const int here = e.unknown(y, x);
            if (here < 0) continue;
            const cv::Vec3f& n = map.normal(y, x);
            if (x + 1 < map.valid.cols && e.unknown(y, x + 1) >= 0)
                difference(here, e.unknown(y, x + 1), (slope_right(n) + slope_right(map.normal(y, x + 1))) / 2);
            if (y + 1 < map.valid.rows && e.unknown(y + 1, x) >= 0)
                difference(here, e.unknown(y + 1, x), (slope_down(n) + slope_down(map.normal(y + 1, x))) / 2);
        }
    for (int i = 0; i < count; ++i) terms.emplace_back(i, i, diagonal[i]);
    e.matrix.resize(count, count);
    e.matrix.setFromTriplets(terms.begin(), terms.end());
    return e;
}

/// Every second pixel's slopes, averaged over the valid ones of its 2x2 block.
NormalMap halved(const NormalMap& map) {
    const cv::Size size((map.valid.cols + 1) / 2, (map.valid.rows + 1) / 2);
    NormalMap half{cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat1b(size, uchar{0})};
    for (int y = 0; y < map.valid.rows; ++y)
        for (int x = 0; x < map.valid.cols; ++x) {
            if (!map.valid(y, x)) continue;
            half.normal(y / 2, x / 2) += map.normal(y, x);
            half.valid(y / 2, x / 2) = 255;
        }
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            if (half.valid(y, x)) half.normal(y, x) = cv::normalize(half.normal(y, x));
    return half;
}

Eigen::VectorXd guess_from(const cv::Mat1f& half, const cv::Mat1i& unknown, int count) {
    Eigen::VectorXd guess(count);
    for (int y = 0; y < unknown.rows; ++y)
        for (int x = 0; x < unknown.cols; ++x)
            if (unknown(y, x) >= 0) guess[unknown(y, x)] = 2.0 * half(y / 2, x / 2);
    return guess;
}

Eigen::VectorXd solve_directly(const Equations& e) {
    const Eigen::SimplicialLDLT<Sparse> solver(e.matrix);
    return solver.solve(e.right);
}

/// From coarse to fine: the half-size solution leaves only fine detail to the iterations.
Eigen::VectorXd solve_from_coarse(const Equations& e, const NormalMap& normals) {
    const cv::Mat1f half = integrate_normals(halved(normals));
    Eigen::ConjugateGradient<Sparse, Eigen::Lower> solver;
    solver.setMaxIterations(most_iterations);
    solver.setTolerance(tolerance);
    solver.compute(e.matrix);
    return solver.solveWithGuess(e.right, guess_from(half, e.unknown, static_cast<int>(e.right.size())));
}

}  // namespace

cv::Mat1f integrate_normals(const NormalMap& normals) {
    if (normals.valid.empty() || cv::countNonZero(normals.valid) == 0)
        throw InputError("the normal map has no valid pixel to integrate", "check the mask");
    const Equations e = equations_of(normals);
    const Eigen::VectorXd z =
        e.right.size() <= most_direct_unknowns ? solve_directly(e) : solve_from_coarse(e, normals);
    cv::Mat1f height(normals.valid.size(), 0.0F);
    for (int y = 0; y < height.rows; ++y)
        for (int x = 0; x < height.cols; ++x)
            if (e.unknown(y, x) >= 0) height(y, x) = static_cast<float>(z[e.unknown(y, x)]);
    return height;
}

}  // namespace darkbox
