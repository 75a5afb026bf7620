#pragma once

#include <Eigen/Core>
#include <string>

namespace darkbox {

/// The highlight of a surface, in Phong's form: strength times the cosine between mirrored light and view, to the
/// exponent, whatever the albedo. As used here it stands for the broad lobes of any gloss, whose foot most lights of a
/// pixel lie in; narrow highlights are left out as outliers and need no law.
struct GlossLaw {
    double strength = 0;  ///< radiance under a light of irradiance 1 seen in the mirror's direction; 0: no gloss
    double exponent = 1;

    bool present() const { return strength > 0; }
    std::string name() const;  ///< "none", "phong 0.25 n 11"
};

/// Gloss of one sample, and how it changes with the normal.
struct GlossAt {
    float value = 0;
    Eigen::Vector3f slope{0, 0, 0};  ///< derivative along the normal, free of the unit length
};

GlossAt gloss_at(const GlossLaw& law, const Eigen::Vector3f& normal, const Eigen::Vector3f& light,
                 const Eigen::Vector3f& view);

}  // namespace darkbox
