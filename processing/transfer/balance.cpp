#include "processing/transfer/balance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace darkbox {
namespace {

constexpr float least_expected = 0.05F;  ///< uses of a texel whose normal the target hardly has

/// Luminance and two differences of colour: histograms of R, G and B alone do not tell red and green from yellow.
std::array<std::uint8_t, 3> opponent(const std::uint8_t* rgb) {
    const int r = rgb[0];
    const int g = rgb[1];
    const int b = rgb[2];
    return {static_cast<std::uint8_t>((r + 2 * g + b) / 4), static_cast<std::uint8_t>((r - g + 256) / 2),
            static_cast<std::uint8_t>((2 * b - r - g + 512) / 4)};
}

cv::Mat1f blurred_bins(const std::vector<float>& counts) {
    cv::Mat1f bins(normal_bin_side, normal_bin_side);
    std::copy(counts.begin(), counts.end(), bins.begin());
    cv::GaussianBlur(bins, bins, cv::Size(), 1.0);
    return bins;
}

template <class Visit>
void each_valid(const cv::Mat1b& valid, const Visit& visit) {
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) visit(cv::Point(x, y));
}

cv::Vec3f colour_of(const std::uint8_t* rgb) {
    return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
}

template <class Histograms>
void add_to(Histograms& histograms, const std::uint8_t* rgb, double weight) {
    const std::array<std::uint8_t, 3> value = opponent(rgb);
    for (std::size_t c = 0; c < 3; ++c) histograms[c][value[c]] += weight;
}

template <class Histograms>
void make_unit_sum(Histograms& histograms) {
    for (auto& histogram : histograms) {
        double sum = 0;
        for (const double share : histogram) sum += share;
        for (double& share : histogram) share /= std::max(sum, 1e-12);
    }
}

}  // namespace

TextureBalance::TextureBalance(const MapLevel& source, const TexelBytes& source_bytes, const MapLevel& target,
                               const NormalTable& table, int level, const BalanceOptions& options)
    : source_(source),
      source_bytes_(source_bytes),
      target_(target),
      options_(options),
      cell_shift_(std::max(0, 2 - level)),
      cell_sigma_(std::ldexp(options.smooth_sigma, -level - cell_shift_)),
      expected_uses_(source.valid.size(), 0.0F),
      usage_cost_(source.valid.size(), 0.0F),
      cost_(static_cast<std::size_t>(source_bytes.places()), 0.0F) {
    expect_uses(table);
    expect_histograms();
    expect_colour(table);
}

void TextureBalance::observe(const std::vector<int>& places, const TexelBytes& target_bytes) {
    const float share = 1 / static_cast<float>(++observations_);
    observe_usage(places, target_bytes, share);
    observe_histograms(target_bytes, share);
    observe_colour(target_bytes);
    tbb::parallel_for(0, usage_cost_.rows, [&](int y) {
        for (int x = 0; x < usage_cost_.cols; ++x) {
            if (!source_.valid(y, x)) continue;
            const std::array<std::uint8_t, 3> value = opponent(source_bytes_.at({x, y}));
            cost_[static_cast<std::size_t>(source_bytes_.place({x, y}))] =
                usage_cost_(y, x) + potential_[0][value[0]] + potential_[1][value[1]] + potential_[2][value[2]];
        }
    });
}

void TextureBalance::expect_uses(const NormalTable& table) {
    std::vector<float> in_source(normal_bins, 0.0F);
    std::vector<float> in_target(normal_bins, 0.0F);
    for (int bin = 0; bin < normal_bins; ++bin) in_source[bin] = static_cast<float>(table.pixels(bin).size());
    each_valid(target_.valid, [&](cv::Point p) { ++in_target[table.filled_bin(normal_bin(target_.normal(p)))]; });
    const cv::Mat1f source = blurred_bins(in_source);
    const cv::Mat1f target = blurred_bins(in_target);
    for (int bin = 0; bin < normal_bins; ++bin)
        for (const cv::Point& p : table.pixels(bin))
            expected_uses_(p) =
                std::max(least_expected, target.at<float>(bin / normal_bin_side, bin % normal_bin_side) /
                                             source.at<float>(bin / normal_bin_side, bin % normal_bin_side));
}

void TextureBalance::expect_histograms() {
    for (Histogram& histogram : expected_histograms_) histogram.fill(0);
    each_valid(source_.valid,
               [&](cv::Point p) { add_to(expected_histograms_, source_bytes_.at(p), expected_uses_(p)); });
    make_unit_sum(expected_histograms_);
}

/// The mean of the cells around each, weighted by a Gaussian and by how many pixels they have.
cv::Mat3f TextureBalance::smooth_cells(const cv::Mat3f& sums, const cv::Mat1f& counts) const {
    cv::Mat3f smooth = sums;
    cv::Mat1f weight = counts;
    if (cell_sigma_ > 0.3) {
        cv::GaussianBlur(sums, smooth, cv::Size(), cell_sigma_, cell_sigma_, cv::BORDER_CONSTANT);
        cv::GaussianBlur(counts, weight, cv::Size(), cell_sigma_, cell_sigma_, cv::BORDER_CONSTANT);
    }
    cv::Mat3f mean(sums.size(), cv::Vec3f(0, 0, 0));
    for (int y = 0; y < mean.rows; ++y)
        for (int x = 0; x < mean.cols; ++x)
            if (weight(y, x) > 1e-3F) mean(y, x) = smooth(y, x) * (1 / weight(y, x));
    return mean;
}

void TextureBalance::expect_colour(const NormalTable& table) {
    std::vector<cv::Vec3f> colour(normal_bins, cv::Vec3f(0, 0, 0));
    for (int bin = 0; bin < normal_bins; ++bin) {
        for (const cv::Point& p : table.pixels(bin)) colour[bin] += colour_of(source_bytes_.at(p));
        if (!table.pixels(bin).empty()) colour[bin] *= 1 / static_cast<float>(table.pixels(bin).size());
    }
    const cv::Size cells((target_.valid.cols >> cell_shift_) + 1, (target_.valid.rows >> cell_shift_) + 1);
    cv::Mat3f sums(cells, cv::Vec3f(0, 0, 0));
    cv::Mat1f counts(cells, 0.0F);
    each_valid(target_.valid, [&](cv::Point p) {
        const cv::Point cell(p.x >> cell_shift_, p.y >> cell_shift_);
        sums(cell) += colour[table.filled_bin(normal_bin(target_.normal(p)))];
        counts(cell) += 1;
    });
    expected_colour_ = smooth_cells(sums, counts);
}

void TextureBalance::observe_usage(const std::vector<int>& places, const TexelBytes& target_bytes, float share) {
    cv::Mat1f uses(source_.valid.size(), 0.0F);
    each_valid(target_.valid, [&](cv::Point p) {
        uses(source_bytes_.point(places[static_cast<std::size_t>(target_bytes.place(p))])) += 1;
    });
    cv::blur(uses, uses, cv::Size(3, 3), cv::Point(-1, -1), cv::BORDER_CONSTANT);
    tbb::parallel_for(0, uses.rows, [&](int y) {
        for (int x = 0; x < uses.cols; ++x) {
            if (!source_.valid(y, x)) continue;
            const float cost = options_.usage * std::min(options_.most_usage, uses(y, x) / expected_uses_(y, x));
            usage_cost_(y, x) += share * (cost - usage_cost_(y, x));
        }
    });
}

/// The Cramer distance is the integral of (F - E)^2 over values, F and E the cumulative histograms. One more pixel of
/// value v raises F from v on, thus its gradient at v is twice the integral of F - E from v on.
void TextureBalance::observe_histograms(const TexelBytes& target_bytes, float share) {
    std::array<Histogram, 3> histograms{};
    each_valid(target_.valid, [&](cv::Point p) { add_to(histograms, target_bytes.at(p), 1); });
    make_unit_sum(histograms);
    for (std::size_t c = 0; c < 3; ++c) {
        Histogram excess{};
        double sum = 0;
        for (std::size_t v = 0; v < excess.size(); ++v) {
            sum += histograms[c][v] - expected_histograms_[c][v];
            excess[v] = sum;
        }
        double from_here = 0;
        for (std::size_t v = excess.size(); v-- > 0;) {
            const auto cost = static_cast<float>(2 * from_here) * options_.histogram;
            potential_[c][v] += share * (cost - potential_[c][v]);
            from_here += excess[v];
        }
    }
}

void TextureBalance::observe_colour(const TexelBytes& target_bytes) {
    cv::Mat3f sums(expected_colour_.size(), cv::Vec3f(0, 0, 0));
    cv::Mat1f counts(expected_colour_.size(), 0.0F);
    each_valid(target_.valid, [&](cv::Point p) {
        const cv::Point cell(p.x >> cell_shift_, p.y >> cell_shift_);
        sums(cell) += colour_of(target_bytes.at(p));
        counts(cell) += 1;
    });
    pull_ = (smooth_cells(sums, counts) - expected_colour_) * (2.0 * options_.colour);
}

}  // namespace darkbox
