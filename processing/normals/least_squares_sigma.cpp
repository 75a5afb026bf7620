#include "processing/normals/least_squares_sigma.h"

#include <Eigen/Dense>
#include <algorithm>

#include "processing/normals/pixel_sample.h"

namespace darkbox {
namespace {

SigmaPolynomial::Symmetric packed(const Eigen::Matrix3d& m) {
    return {static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(0, 2)),
            static_cast<float>(m(1, 1)), static_cast<float>(m(1, 2)), static_cast<float>(m(2, 2))};
}

void add(SigmaPolynomial::Symmetric& sum, const SigmaPolynomial::Symmetric& term, float factor) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i] * factor;
}

}  // namespace

SigmaPolynomial::SigmaPolynomial(const LightField& field, const NoiseModel& noise)
    : lights(static_cast<float>(field.size())) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    const float share = 1.0F / lights;
    for (std::size_t k = 0; k < field.size(); ++k) {
        const SolverLight& light = field.set().lights[k];
        const Eigen::Vector3d l = light.direction.cast<double>();
        moments += l * l.transpose();
        const Eigen::Vector3d column = light.pseudo_column.cast<double>();
        const Symmetric outer = packed(column * column.transpose());
        const auto per_intensity = 1.0 / static_cast<double>(mean_intensity(light));
        const auto of_dark = static_cast<float>(noise.variance(0) * per_intensity * per_intensity);
        const Eigen::Vector3f of_shot = (l * noise.shot_gain * per_intensity).cast<float>();
        Symmetric of_lamp = packed(field.light(k).covariance);
        for (const std::size_t off_diagonal : {1, 2, 4}) of_lamp[off_diagonal] *= 2;
        add(dark, outer, of_dark);
        for (std::size_t i = 0; i < shot.size(); ++i) add(shot[i], outer, of_shot[static_cast<Eigen::Index>(i)]);
        for (std::size_t i = 0; i < lamps.size(); ++i) add(lamps[i], outer, of_lamp[i]);
        mean_dark += of_dark * share;
        for (std::size_t i = 0; i < mean_shot.size(); ++i)
            mean_shot[i] += of_shot[static_cast<Eigen::Index>(i)] * share;
        add(mean_lamps, of_lamp, share);
    }
    inverse_moments = packed(moments.inverse());
    lamps_known = std::any_of(lamps.begin(), lamps.end(), [](const Symmetric& s) {
        return std::any_of(s.begin(), s.end(), [](float value) { return value != 0.0F; });
    });
}

}  // namespace darkbox
