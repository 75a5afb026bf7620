#include "processing/normals/photometric_stereo.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <vector>

#include "acquisition/frame/error.h"
#include "processing/maps/parallel.h"
#include "processing/normals/bands.h"
#include "processing/normals/by_pixel.h"
#include "processing/normals/least_squares.h"
#include "processing/normals/least_squares_sigma.h"
#include "processing/normals/light_set.h"
#include "processing/normals/median_variance.h"

namespace darkbox {
namespace {

/// Solves bands one after the other into the maps of the whole picture.
class BandSolver {
public:
    BandSolver(const LightField& field, const SampleModel& model, const PhotometricStereoOptions& options,
               const WorkContext& work, SolvedMaps& maps)
        : field_(field), model_(model), options_(options), work_(work), maps_(maps) {}

    void solve(const PhotoBand& band) {
        mask_known_ = !band.mask.empty();
        tbb::parallel_for(tbb::blocked_range<int>(0, band.rows()), [&](const tbb::blocked_range<int>& rows) {
            const auto start = std::chrono::steady_clock::now();
            for (int row = rows.begin(); row < rows.end() && !work_.cancelled(); ++row)
                not_finite_ += solve_row(band, row);
            busy_ += std::chrono::steady_clock::duration(std::chrono::steady_clock::now() - start).count();
        });
    }

    /// The bands came with their mask.
    bool mask_known() const { return mask_known_; }
    std::size_t not_finite() const { return not_finite_; }
    double busy_seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::duration(busy_)).count();
    }

private:
    std::size_t solve_row(const PhotoBand& band, int row) {
        if (options_.solver == Solver::robust)
            return solve_row_by_pixel(band, field_, PixelMethod::robust, model_, options_.min_albedo, row, maps_,
                                      options_.uses);
        if (!field_.uniform())
            return solve_row_by_pixel(band, field_, PixelMethod::least_squares, model_, options_.min_albedo, row,
                                      maps_);
        return solve_row_least_squares(band, field_.set(), options_.min_albedo, row, maps_);
    }

    const LightField& field_;
    const SampleModel& model_;
    const PhotometricStereoOptions& options_;
    const WorkContext& work_;
    SolvedMaps& maps_;
    bool mask_known_ = true;
    std::atomic<std::size_t> not_finite_ = 0;
    std::atomic<std::chrono::steady_clock::rep> busy_ = 0;
};

void stop_if_wished(const WorkContext& work) {
    if (work.cancelled()) throw Cancelled("photometric stereo was cancelled", "run it again to get normals");
}

/// Reads band after band, each while the one before it is solved.
void solve_bands(PhotoSource& photos, int band_rows, const WorkContext& work, BandSolver& solver) {
    const int rows = photos.size().height;
    PhotoBand current, next;
    photos.read_next(std::min(band_rows, rows), current);
    for (int solved = 0; solved < rows;) {
        work.tell({"normals", static_cast<std::size_t>(solved), static_cast<std::size_t>(rows), ""});
        stop_if_wished(work);
        solved += current.rows();
        if (const int coming = std::min(band_rows, rows - solved); coming > 0)
            tbb::parallel_invoke([&] { photos.read_next(coming, next); }, [&] { solver.solve(current); });
        else
            solver.solve(current);
        std::swap(current, next);
    }
    stop_if_wished(work);
    work.tell({"normals", static_cast<std::size_t>(rows), static_cast<std::size_t>(rows), ""});
}

/// Takes back what was solved outside the mask, where it became known only afterwards.
void keep_inside(const cv::Mat1b& mask, SolvedMaps& maps) {
    cv::Mat1b outside;
    cv::compare(mask, 0, outside, cv::CMP_EQ);
    for (cv::Mat* map : std::initializer_list<cv::Mat*>{&maps.normal, &maps.albedo, &maps.valid, &maps.residual,
                                                        &maps.lights_used, &maps.sigma_deg})
        map->setTo(cv::Scalar::all(0), outside);
}

/// Over valid pixels; rows are summed up in their order, so that the figure does not depend on threads.
void sum_up(const SolvedMaps& maps, PhotometricStereoResult& result) {
    struct RowSums {
        double squared = 0;
        std::size_t samples = 0, pixels = 0;
    };
    std::vector<RowSums> rows(static_cast<std::size_t>(maps.valid.rows));
    tbb::parallel_for(0, maps.valid.rows, [&](int y) {
        RowSums& sums = rows[static_cast<std::size_t>(y)];
        for (int x = 0; x < maps.valid.cols; ++x) {
            const double residual = static_cast<double>(maps.residual(y, x));
            sums.squared += residual * residual * maps.lights_used(y, x);
            sums.samples += maps.lights_used(y, x);
            sums.pixels += maps.valid(y, x) != 0 ? 1 : 0;
        }
    });
    RowSums total;
    for (const RowSums& row : rows) {
        total.squared += row.squared;
        total.samples += row.samples;
        total.pixels += row.pixels;
    }
    result.pixels = total.pixels;
    if (total.samples > 0) result.residual_rms = std::sqrt(total.squared / static_cast<double>(total.samples));
}

SampleModel model_for(PhotoSource& photos, const LightField& field, const PhotometricStereoOptions& options,
                      int band_rows, const WorkContext& work) {
    if (options.solver == Solver::lsq) return {BodyLaw{}, GlossLaw{}, options.model.noise.value_or(NoiseModel{})};
    const SampleModel model = find_sample_model(photos, field, options.model, band_rows, work);
    stop_if_wished(work);
    return model;
}

/// The confidence of least squares over distant lights, which the pixel loops leave to the finished maps.
void predict_least_squares_sigma(const LightField& field, const NoiseModel& noise, SolvedMaps& maps) {
    const SigmaPolynomial polynomial(field, noise);
    const float variance = median_variance(maps);
    tbb::parallel_for(0, maps.valid.rows, [&](int row) { write_sigma_row(polynomial, variance, row, maps); });
}

PhotometricStereoResult solve(PhotoSource& photos, const LightField& field, const PhotometricStereoOptions& options,
                              const WorkContext& work) {
    const int band_rows = rows_of_a_band(photos, options);
    const auto start = std::chrono::steady_clock::now();
    const SampleModel model = model_for(photos, field, options, band_rows, work);
    const double model_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    SolvedMaps maps(photos.size());
    BandSolver solver(field, model, options, work, maps);
    solve_bands(photos, band_rows, work, solver);
    if (!solver.mask_known()) keep_inside(photos.mask(), maps);
    if (options.solver == Solver::lsq && field.uniform()) predict_least_squares_sigma(field, model.noise, maps);

    PhotometricStereoResult result;
    sum_up(maps, result);
    result.normals = {maps.normal, maps.valid};
    result.albedo = {maps.albedo, maps.valid.clone()};
    result.residual = maps.residual;
    result.lights_used = maps.lights_used;
    result.sigma_deg = maps.sigma_deg;
    result.model = model;
    result.not_finite = solver.not_finite();
    result.seconds = model_seconds + solver.busy_seconds() / tbb::this_task_arena::max_concurrency();
    return result;
}

}  // namespace

void PhotometricStereoOptions::validate() const {
    if (!(std::isfinite(min_albedo) && min_albedo >= 0.0F))
        throw InputError(fmt::format("min_albedo is {}", min_albedo), "allowed: 0 or more (1.0 = full scale)");
    if (model.noise) model.noise->validate();
    if (memory_mib < 1) throw InputError(fmt::format("memory_mib is {}", memory_mib), "allowed: 1 or more");
    if (uses != nullptr && solver != Solver::robust)
        throw InputError("least squares does not tell shadows and highlights from other samples",
                         "use the robust solver for it: --solver robust");
    if (band_rows < 0)
        throw InputError(fmt::format("band_rows is {}", band_rows), "allowed: 1 or more, or 0 for as many as fit");
}

PhotometricStereoResult photometric_stereo(PhotoSource& photos, const Lights& lights,
                                           const PhotometricStereoOptions& options, const WorkContext& work) {
    options.validate();
    if (lights.size() != photos.count())
        throw InputError(fmt::format("there are {} photographs but {} lights", photos.count(), lights.size()),
                         "give one light for each photograph, in the same order");
    const LightSet set = LightSet::from(lights);
    const LightField field(lights, set, options.geometry, photos.size());
    return on_threads_of(work, [&] { return solve(photos, field, options, work); });
}

PhotometricStereoResult photometric_stereo(const PhotoStack& stack, const Lights& lights,
                                           const PhotometricStereoOptions& options, const WorkContext& work) {
    PhotosInMemory photos(stack);
    return photometric_stereo(photos, lights, options, work);
}

}  // namespace darkbox
