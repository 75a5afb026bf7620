#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "acquisition/frame/progress.h"
#include "processing/maps/maps.h"

namespace darkbox {

/// The terms of a polynomial texture map in the order of its files; (u, v) are the light direction's x and y.
enum class PtmTerm { uu, vv, uv, u, v, one };
constexpr int ptm_terms = 6;
using PtmCoefficients = std::array<cv::Mat, ptm_terms>;

/// The six terms for one light.
std::array<double, ptm_terms> ptm_basis(const Eigen::Vector3d& direction);

enum class PtmModel {
    rgb,   ///< a polynomial for each channel
    lrgb,  ///< one polynomial for the luminance, times a colour
};

/// Malzbender, Gelb, Wolters 2001, "Polynomial Texture Maps", SIGGRAPH, sections 3.2 and 3.3: at every pixel
/// a0 u^2 + a1 v^2 + a2 u v + a3 u + a4 v + a5.
struct Ptm {
    PtmModel model = PtmModel::rgb;
    PtmCoefficients coefficient;  ///< CV_32FC3 (R, G, B) for rgb, CV_32FC1 for lrgb
    cv::Mat3f colour;             ///< lrgb: its greatest channel is 1 (white where black); empty for rgb

    cv::Size size() const { return coefficient.front().size(); }
};

/// Gathers photographs one at a time, so that memory does not grow with their number: 18 floats a pixel for rgb, 10 for
/// lrgb. Thread-compatible.
class PtmFit {
public:
    /// Throws InputError for fewer than six used lights, or lights whose terms are not independent.
    PtmFit(cv::Size size, PtmModel model, const Lights& lights);

    /// The photograph under lights[index], in whatever curve the result is to be shown; once for each used light.
    /// Ignored for a light that is not used. Throws InputError for another size.
    void add(const cv::Mat3f& photograph, std::size_t index, const WorkContext& work = {});
    /// What all photographs together say.
    Ptm result() const;

private:
    PtmModel model_;
    std::vector<bool> used_;
    Eigen::MatrixXd solution_;  ///< terms x lights: the pseudo-inverse of the lights' terms
    PtmCoefficients coefficient_;
    cv::Mat3f weighted_colour_;  ///< lrgb: sum of colour times luminance
    cv::Mat1f squared_luminance_;
};

/// Least squares over all used lights at every pixel of the stack, each photograph divided by its light's intensity;
/// shadows and highlights are fitted as they are. Samples are taken as they come (linear in a PhotoStack).
/// Bit-identical on any number of threads. Throws InputError as require_consistent() and PtmFit do.
Ptm fit_ptm(const PhotoStack& stack, const Lights& lights, PtmModel model = PtmModel::rgb,
            const WorkContext& work = {});

/// The picture under a distant light of intensity 1 from `direction` (unit vector, viewer frame). Not clamped.
cv::Mat3f evaluate(const Ptm& ptm, const Eigen::Vector3d& direction);

}  // namespace darkbox
