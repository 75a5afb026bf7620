#include "processing/normals/law_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace darkbox {
namespace {

constexpr float better_than_known = 0.97F;
constexpr std::size_t most_pixels_of_gloss = 200;
constexpr std::array<double, 5> exponents{4, 8, 16, 32, 64};
constexpr std::array<double, 5> strengths{0.08, 0.16, 0.32, 0.64, 1.28};  ///< of the median albedo

/// A law with its body's factor made ready.
struct Candidate {
    explicit Candidate(const SurfaceLaw& given) : law(given), factor(given.body) {}

    SurfaceLaw law;
    BodyFactor factor;
};

float median(std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

/// Each candidate's misfit at one pixel relative to the first's, all judged on the scale of the best; empty where one
/// fails.
std::vector<float> relative_misfits(const PixelSamples& pixel, const std::vector<Candidate>& candidates) {
    PixelSolver solver;
    solver.samples = pixel;
    float scale = std::numeric_limits<float>::infinity();
    std::vector<std::vector<float>> residuals;
    for (const Candidate& candidate : candidates) {
        if (!solver.solve(candidate.factor, candidate.law.gloss)) return {};
        scale = std::min(scale, solver.scale());
        residuals.push_back(solver.lit_residuals());
    }
    std::vector<float> misfits;
    for (const auto& of_law : residuals) misfits.push_back(misfit(of_law, scale));
    const float known = misfits.front();
    if (!(known > 0)) return {};
    for (float& value : misfits) value /= known;
    return misfits;
}

/// The first of the candidates unless another is better by enough.
SurfaceLaw best_of(const std::vector<Candidate>& candidates, const std::vector<PixelSamples>& pixels, float enough) {
    std::vector<std::vector<float>> misfits(pixels.size());
    tbb::parallel_for(std::size_t{0}, pixels.size(),
                      [&](std::size_t i) { misfits[i] = relative_misfits(pixels[i], candidates); });
    std::size_t best = 0;
    float smallest = enough;
    for (std::size_t law = 1; law < candidates.size(); ++law) {
        std::vector<float> of_law;
        for (const auto& at_pixel : misfits)
            if (!at_pixel.empty()) of_law.push_back(at_pixel[law]);
        if (of_law.empty()) break;
        if (const float middle = median(of_law); middle < smallest) smallest = middle, best = law;
    }
    return candidates[best].law;
}

SurfaceLaw with_best_body(const SurfaceLaw& known, const std::vector<PixelSamples>& pixels) {
    std::vector<Candidate> candidates{Candidate(known)};
    for (const BodyLaw& body : body_laws())
        if (body.kind != known.body.kind || body.parameter != known.body.parameter)
            candidates.emplace_back(SurfaceLaw{body, known.gloss});
    return best_of(candidates, pixels, better_than_known);
}

float median_albedo(const SurfaceLaw& law, const std::vector<PixelSamples>& pixels) {
    const BodyFactor factor(law.body);
    PixelSolver solver;
    std::vector<float> albedos;
    for (const PixelSamples& pixel : pixels) {
        solver.samples = pixel;
        if (const auto fit = solver.solve(factor, law.gloss)) albedos.push_back(fit->g.norm());
    }
    return albedos.empty() ? 0.0F : median(albedos);
}

/// The lobes about this one, a factor away in exponent, strength or both.
std::vector<Candidate> neighbours(const SurfaceLaw& law, double factor) {
    std::vector<Candidate> candidates{Candidate(law)};
    for (const double e : {1 / factor, 1.0, factor})
        for (const double s : {1 / factor, 1.0, factor})
            if (e != 1.0 || s != 1.0)
                candidates.emplace_back(SurfaceLaw{law.body, {law.gloss.strength * s, law.gloss.exponent * e}});
    return candidates;
}

SurfaceLaw with_best_gloss(const SurfaceLaw& known, const std::vector<PixelSamples>& pixels) {
    const auto albedo = static_cast<double>(median_albedo(known, pixels));
    if (!(albedo > 0)) return known;
    std::vector<Candidate> candidates{Candidate(known)};
    for (const double exponent : exponents)
        for (const double strength : strengths)
            candidates.emplace_back(SurfaceLaw{known.body, {strength * albedo, exponent}});
    SurfaceLaw law = best_of(candidates, pixels, better_than_known);
    if (!law.gloss.present()) return known;
    for (const double factor : {std::sqrt(2.0), std::pow(2.0, 0.25)})
        law = best_of(neighbours(law, factor), pixels, 1.0F);
    return law;
}

/// At most so many, evenly over the list.
std::vector<PixelSamples> some_of(const std::vector<PixelSamples>& pixels, std::size_t most) {
    const std::size_t step = std::max<std::size_t>(1, (pixels.size() + most - 1) / most);
    std::vector<PixelSamples> some;
    for (std::size_t i = 0; i < pixels.size(); i += step) some.push_back(pixels[i]);
    return some;
}

}  // namespace

SurfaceLaw find_surface_law(const std::vector<PixelSamples>& pixels) {
    const SurfaceLaw matt = with_best_body({}, pixels);
    const SurfaceLaw glossy = with_best_gloss(matt, some_of(pixels, most_pixels_of_gloss));
    return glossy.gloss.present() ? with_best_body(glossy, pixels) : matt;
}

}  // namespace darkbox
