#include "processing/relight/relight.h"

#include <chrono>

#include "processing/relight/relighter.h"
#include "processing/relight/scene_checks.h"

namespace darkbox {
namespace {

class Stopwatch {
public:
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

void RelightOptions::validate() const {
    require_range("phong_diffuse", phong_diffuse, 0, 1);
    require_range("phong_specular", phong_specular, 0, 1);
    require_range("phong_exponent", phong_exponent, 1, 1000);
    for (int c = 0; c < 3; ++c) require_range("specular_colour", specular_colour[c], 0, 1);
    require_range("environment_yaw", environment_yaw, -1000, 1000);
    require_range("exposure", exposure, 0, 1e9);
}

RelightResult relight(const RelightScene& scene, const Lights& lights, const RelightOptions& options,
                      const WorkContext& work) {
    const Relighter relighter(scene, work);
    RelightResult result;
    result.image.create(relighter.size());
    const Stopwatch rendering;
    relighter.render(lights, options, result.image, work);
    result.render_seconds = rendering.seconds();
    return result;
}

RelightResult relight(const RelightScene& scene, const Environment& environment, const RelightOptions& options,
                      const WorkContext& work) {
    const Relighter relighter(scene, work);
    RelightResult result;
    result.image.create(relighter.size());
    const Stopwatch folding;
    const FoldedEnvironment folded = relighter.fold(environment, options, work);
    result.fold_seconds = folding.seconds();
    const Stopwatch rendering;
    relighter.render(folded, options, result.image, work);
    result.render_seconds = rendering.seconds();
    return result;
}

}  // namespace darkbox
