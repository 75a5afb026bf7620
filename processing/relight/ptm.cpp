#include "processing/relight/ptm.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/SVD>
#include <algorithm>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/maps/require.h"

namespace darkbox {
namespace {

constexpr double least_independence = 1e-3;  // smallest singular value of the terms over the largest

float luminance(const cv::Vec3f& p) { return (p[0] + p[1] + p[2]) / 3.0F; }

template <class Row>
void for_rows(int rows, const WorkContext& work, Row&& row) {
    on_threads_of(work, [&] {
        tbb::parallel_for(tbb::blocked_range<int>(0, rows), [&](const tbb::blocked_range<int>& range) {
            for (int y = range.begin(); y < range.end(); ++y) row(y);
        });
    });
}

/// Terms x lights; a light that is not used has zeros.
Eigen::MatrixXd pseudo_inverse(const Lights& lights) {
    const auto used = std::count_if(lights.begin(), lights.end(), [](const Light& light) { return light.used; });
    if (used < ptm_terms)
        throw InputError(
            fmt::format("a polynomial texture map needs at least six lights, but only {} can be used", used),
            "capture more lamps, or use another format");
    Eigen::MatrixXd terms = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(lights.size()), ptm_terms);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        const auto basis = ptm_basis(lights[i].direction);
        for (int t = 0; t < ptm_terms; ++t) terms(static_cast<Eigen::Index>(i), t) = basis[static_cast<std::size_t>(t)];
    }
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(terms, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const auto& singular = svd.singularValues();
    if (singular[ptm_terms - 1] < least_independence * singular[0])
        throw InputError(
            "the lights do not tell the six terms of a polynomial texture map apart: they lie on one "
            "ellipse about the camera's axis, or nearly",
            "add lights at other elevations, one near the camera's axis for instance");
    return svd.matrixV() * singular.cwiseInverse().asDiagonal() * svd.matrixU().transpose();
}

}  // namespace

std::array<double, ptm_terms> ptm_basis(const Eigen::Vector3d& direction) {
    const double u = direction.x(), v = direction.y();
    return {u * u, v * v, u * v, u, v, 1.0};
}

PtmFit::PtmFit(cv::Size size, PtmModel model, const Lights& lights) : model_(model), solution_(pseudo_inverse(lights)) {
    require_lights(lights);
    for (const Light& light : lights) used_.push_back(light.used);
    for (cv::Mat& coefficient : coefficient_)
        coefficient = cv::Mat::zeros(size, model == PtmModel::rgb ? CV_32FC3 : CV_32FC1);
    if (model == PtmModel::rgb) return;
    weighted_colour_ = cv::Mat3f(size, cv::Vec3f(0, 0, 0));
    squared_luminance_ = cv::Mat1f(size, 0.0F);
}

void PtmFit::add(const cv::Mat3f& photograph, std::size_t index, const WorkContext& work) {
    require_size("the photograph", photograph.size(), coefficient_.front().size());
    if (!used_.at(index)) return;
    std::array<float, ptm_terms> share{};
    for (int t = 0; t < ptm_terms; ++t)
        share[static_cast<std::size_t>(t)] = static_cast<float>(solution_(t, static_cast<Eigen::Index>(index)));
    for_rows(photograph.rows, work, [&](int y) {
        for (std::size_t t = 0; t < ptm_terms; ++t)
            for (int x = 0; x < photograph.cols; ++x)
                if (model_ == PtmModel::rgb)
                    coefficient_[t].at<cv::Vec3f>(y, x) += share[t] * photograph(y, x);
                else
                    coefficient_[t].at<float>(y, x) += share[t] * luminance(photograph(y, x));
        if (model_ == PtmModel::rgb) return;
        for (int x = 0; x < photograph.cols; ++x) {
            const float l = luminance(photograph(y, x));
            weighted_colour_(y, x) += l * photograph(y, x);
            squared_luminance_(y, x) += l * l;
        }
    });
}

Ptm PtmFit::result() const {
    Ptm ptm{model_, {}, {}};
    std::transform(coefficient_.begin(), coefficient_.end(), ptm.coefficient.begin(),
                   [](const cv::Mat& values) { return values.clone(); });
    if (model_ == PtmModel::rgb) return ptm;
    ptm.colour = cv::Mat3f(ptm.size(), cv::Vec3f(1, 1, 1));
    for (int y = 0; y < ptm.colour.rows; ++y)
        for (int x = 0; x < ptm.colour.cols; ++x) {
            const cv::Vec3f& sum = weighted_colour_(y, x);
            const float greatest = std::max({sum[0], sum[1], sum[2]});
            if (!(greatest > 0 && squared_luminance_(y, x) > 0)) continue;
            for (int c = 0; c < 3; ++c) ptm.colour(y, x)[c] = std::max(0.0F, sum[c] / greatest);
            for (cv::Mat& coefficient : ptm.coefficient)
                coefficient.at<float>(y, x) *= greatest / squared_luminance_(y, x);
        }
    return ptm;
}

Ptm fit_ptm(const PhotoStack& stack, const Lights& lights, PtmModel model, const WorkContext& work) {
    require_consistent(stack);
    if (lights.size() != stack.images.size())
        throw InputError(fmt::format("there are {} photographs but {} lights", stack.images.size(), lights.size()),
                         "give one light for each photograph, in the same order");
    PtmFit fit(stack.size(), model, lights);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!lights[i].used) continue;
        if (work.cancelled()) throw Cancelled("the fit was cancelled", "run it again");
        const Eigen::Vector3d& e = lights[i].intensity;
        cv::Mat3f relative;
        cv::divide(stack.images[i], cv::Scalar(e[0], e[1], e[2]), relative);
        fit.add(relative, i, work);
    }
    return fit.result();
}

cv::Mat3f evaluate(const Ptm& ptm, const Eigen::Vector3d& direction) {
    const auto basis = ptm_basis(direction);
    cv::Mat3f image(ptm.size(), cv::Vec3f(0, 0, 0));
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x) {
            cv::Vec3f sum(0, 0, 0);
            for (std::size_t t = 0; t < ptm_terms; ++t) {
                const auto factor = static_cast<float>(basis[t]);
                sum += factor * (ptm.model == PtmModel::rgb ? ptm.coefficient[t].at<cv::Vec3f>(y, x)
                                                            : ptm.coefficient[t].at<float>(y, x) * ptm.colour(y, x));
            }
            image(y, x) = sum;
        }
    return image;
}

}  // namespace darkbox
