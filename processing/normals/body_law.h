#pragma once

#include <array>
#include <string>
#include <vector>

namespace darkbox {

/// How the body of a material, its highlight left out, returns light: albedo (n.l) times a factor that is 1 where
/// light, normal and view coincide.
enum class BodyKind {
    lambert,  ///< factor 1
    smooth,   ///< pigment below a smooth dielectric surface: what enters is 1 - F(n.l) (Wolff, JOSA A 11(11) 1994)
    rough,    ///< matt facets (Oren and Nayar, SIGGRAPH 1994, the qualitative model, equation 30)
};

struct BodyLaw {
    BodyKind kind = BodyKind::lambert;
    double parameter = 0;  ///< smooth: refractive index; rough: standard deviation of the facets' slopes, radians

    std::string name() const;  ///< "lambert", "smooth 1.30", "rough 0.30"
};

/// The laws that robust photometric stereo chooses from; Lambert's first.
const std::vector<BodyLaw>& body_laws();

/// The factor of one law, Fresnel's equations tabulated. Thread-safe once made.
class BodyFactor {
public:
    explicit BodyFactor(const BodyLaw& law);

    bool constant() const { return kind_ == BodyKind::lambert; }
    /// Cosines between normal and light, normal and view, light and view. Those of the normal are held above 0.05:
    /// nearer the terminator no law is trusted.
    float operator()(float n_dot_l, float n_dot_v, float l_dot_v) const;

private:
    static constexpr int steps = 256;

    BodyKind kind_ = BodyKind::lambert;
    float slope_ = 0;                          ///< of the rough law, relative to its value facing the light
    std::array<float, steps + 1> entering_{};  ///< of the smooth law, over n.l
};

}  // namespace darkbox
