#include "processing/normals/by_pixel.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "processing/normals/pixel_sample.h"
#include "processing/normals/pixel_solver.h"
#include "processing/normals/predicted_sigma.h"

namespace darkbox {
namespace {

/// One row's work: what is shared by its pixels.
class RowByPixel {
public:
    RowByPixel(const LightField& field, PixelMethod method, const SampleModel& model, float min_albedo,
               SampleUseSink* sink)
        : field_(field), method_(method), model_(model), factor_(model.law), min_albedo_(min_albedo), sink_(sink) {}

    std::size_t solve(const PhotoBand& band, int row, SolvedMaps& maps) {
        samples_.load(band, field_.set(), row);
        const std::size_t lights = field_.set().lights.size();
        if (sink_ != nullptr) uses_.assign(lights * static_cast<std::size_t>(samples_.cols()), SampleUse::no_normal);
        const int picture_row = band.first_row + row;
        std::size_t not_finite = 0;
        for (int x = 0; x < samples_.cols(); ++x) {
            write_nothing(picture_row, x, maps);
            if (!band.mask.empty() && band.mask(row, x) == 0) continue;
            if (samples_.finite(x))
                solve_pixel(picture_row, x, maps);
            else
                ++not_finite;
        }
        if (sink_ != nullptr)
            for (std::size_t k = 0; k < lights; ++k) sink_->take(picture_row, field_.set().lights[k].image, uses_of(k));
        return not_finite;
    }

private:
    static void write_nothing(int row, int column, SolvedMaps& maps) {
        maps.normal(row, column) = cv::Vec3f::all(0);
        maps.albedo(row, column) = cv::Vec3f::all(0);
        maps.valid(row, column) = 0;
        maps.residual(row, column) = 0;
        maps.lights_used(row, column) = 0;
        maps.sigma_deg(row, column) = 0;
    }

    void solve_pixel(int row, int column, SolvedMaps& maps) {
        if (!field_.uniform() || arrivals_.empty()) field_.arrivals(row, column, arrivals_);
        samples_.fill(field_, arrivals_, model_.noise, column, solver_.samples);
        solver_.samples.view = field_.to_camera(row, column);
        const auto fit =
            method_ == PixelMethod::robust ? solver_.solve(factor_, model_.gloss) : solver_.solve_least_squares();
        if (!fit) return;
        const cv::Vec3f albedo = albedo_at(column);
        if (!((albedo[0] + albedo[1] + albedo[2]) / 3.0F >= min_albedo_)) return;
        const Eigen::Vector3f normal = fit->g.normalized();
        maps.normal(row, column) = {normal.x(), normal.y(), normal.z()};
        maps.albedo(row, column) = albedo;
        maps.valid(row, column) = 255;
        write_confidence(*fit, row, column, maps);
        if (sink_ != nullptr)
            for (std::size_t k = 0; k < arrivals_.size(); ++k)
                uses_of(k)[static_cast<std::size_t>(column)] = solver_.use(k);
    }

    std::span<SampleUse> uses_of(std::size_t k) {
        const auto cols = static_cast<std::size_t>(samples_.cols());
        return std::span(uses_).subspan(k * cols, cols);
    }

    /// None of the weights is above zero where no sample was kept: black then.
    cv::Vec3f albedo_at(int column) const {
        cv::Vec3f colour = cv::Vec3f::all(0);
        float total = 0;
        for (std::size_t k = 0; k < arrivals_.size(); ++k) {
            const float shading = std::max(solver_.cosine(k), 0.0F) * solver_.factors()[k];
            const float weight = solver_.weights()[k] * shading;
            const cv::Vec3f gloss = cv::Vec3f::all(solver_.gloss(k));
            colour += (samples_.colour(k, column) * (1.0F / arrivals_[k].falloff) - gloss) * weight;
            total += weight * shading;
        }
        return total > 0 ? cv::Vec3f(colour * (1.0F / total)) : cv::Vec3f::all(0);
    }

    void write_confidence(const PixelFit& fit, int row, int column, SolvedMaps& maps) {
        const std::vector<float>& weights = solver_.weights();
        float squares = 0;
        for (std::size_t k = 0; k < weights.size(); ++k)
            if (weights[k] > 0) squares += solver_.residual(k) * solver_.residual(k);
        maps.lights_used(row, column) = static_cast<ushort>(fit.used);
        maps.residual(row, column) = std::sqrt(squares / static_cast<float>(std::max(fit.used, 1)));
        maps.sigma_deg(row, column) = predicted_sigma_deg(fit, solver_, field_);
    }

    const LightField& field_;
    PixelMethod method_;
    const SampleModel& model_;
    BodyFactor factor_;
    float min_albedo_;
    SampleUseSink* sink_;
    std::vector<SampleUse> uses_;  ///< of this row: one photograph after the other
    SampleRow samples_;
    PixelSolver solver_;
    std::vector<Arrival> arrivals_;
};

}  // namespace

std::size_t solve_row_by_pixel(const PhotoBand& band, const LightField& field, PixelMethod method,
                               const SampleModel& model, float min_albedo, int row, SolvedMaps& maps,
                               SampleUseSink* uses) {
    return RowByPixel(field, method, model, min_albedo, uses).solve(band, row, maps);
}

}  // namespace darkbox
