#include "processing/pipeline/merge_exposures.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

/// Standard deviations below full scale from which on a sample is not cut off.
constexpr double clear_of_clipping = 4;
/// Weights hardly change after that.
constexpr int refinements = 3;

double frame_variance(const ExposureRows& exposure, double signal) {
    const SensorNoise& noise = exposure.noise;
    const double variance = noise.floor + noise.slope * std::max(signal, 0.0);
    return variance > 0 ? variance : 1.0;
}

/// Of the radiance that this exposure alone tells, where the true one is `radiance`.
double variance_of(const ExposureRows& exposure, double radiance) {
    const double unlit = exposure.unlit_frames > 0 ? frame_variance(exposure, 0) / exposure.unlit_frames : 0.0;
    const double signal = frame_variance(exposure, radiance / exposure.radiance) / exposure.frames;
    return exposure.radiance * exposure.radiance * (signal + unlit);
}

/// One channel of one pixel, over the exposures.
class Sample {
public:
    Sample(const std::vector<ExposureRows>& exposures, std::size_t shortest)
        : exposures_(exposures), shortest_(shortest), values_(exposures.size()), used_(exposures.size()) {}

    void take(int row, int column) {
        for (std::size_t i = 0; i < exposures_.size(); ++i) {
            const ExposureRows& e = exposures_[i];
            const double unlit = e.unlit(row, column / 3)[column % 3];
            const double sum = e.sum(row, column / 3)[column % 3];
            values_[i] = (sum / e.frames - unlit) * e.radiance;
            used_[i] = e.clipped(row, column / 3)[column % 3] == 0;
        }
        clipped_ = !used_[shortest_];
        used_[shortest_] = true;
        const double first = values_[shortest_], its_variance = variance_of(exposures_[shortest_], first);
        for (std::size_t i = 0; i < exposures_.size(); ++i) {
            const ExposureRows& e = exposures_[i];
            const double signal = first / e.radiance;
            const double sigma = std::sqrt(frame_variance(e, signal) + its_variance / (e.radiance * e.radiance));
            const double room = e.full_scale - e.unlit(row, column / 3)[column % 3];
            if (i != shortest_ && signal + clear_of_clipping * sigma >= room) used_[i] = false;
        }
        merge();
    }
    bool clipped() const { return clipped_; }
    double radiance() const { return radiance_; }
    double variance() const { return variance_; }

private:
    /// Begins with shot noise alone: every photon counts the same, whichever frame caught it.
    void merge() {
        double photons = 0, light = 0;
        for (std::size_t i = 0; i < values_.size(); ++i) {
            if (!used_[i]) continue;
            const double caught = exposures_[i].frames / exposures_[i].radiance;
            photons += values_[i] * caught;
            light += caught;
        }
        radiance_ = photons / light;
        for (int again = 0; again < refinements; ++again) {
            double sum = 0, weights = 0;
            for (std::size_t i = 0; i < values_.size(); ++i) {
                if (!used_[i]) continue;
                const double weight = 1 / variance_of(exposures_[i], radiance_);
                sum += weight * values_[i];
                weights += weight;
            }
            radiance_ = sum / weights;
            variance_ = 1 / weights;
        }
    }

    const std::vector<ExposureRows>& exposures_;
    const std::size_t shortest_;
    std::vector<double> values_;  ///< radiance by each exposure alone
    std::vector<char> used_;
    bool clipped_ = false;
    double radiance_ = 0;
    double variance_ = 0;
};

}  // namespace

MergedRows merge_exposures(const std::vector<ExposureRows>& exposures) {
    const cv::Size size = exposures.front().sum.size();
    const auto by_radiance = [](const ExposureRows& a, const ExposureRows& b) { return a.radiance < b.radiance; };
    const auto shortest = std::max_element(exposures.begin(), exposures.end(), by_radiance) - exposures.begin();
    MergedRows merged{cv::Mat3f(size), cv::Mat1b(size, uchar{0}), cv::Mat3f(size)};
    Sample sample(exposures, static_cast<std::size_t>(shortest));
    for (int row = 0; row < size.height; ++row)
        for (int column = 0; column < 3 * size.width; ++column) {
            sample.take(row, column);
            merged.radiance(row, column / 3)[column % 3] = static_cast<float>(sample.radiance());
            merged.variance(row, column / 3)[column % 3] = static_cast<float>(sample.variance());
            if (sample.clipped()) merged.clipped(row, column / 3) = 255;
        }
    return merged;
}

}  // namespace darkbox
