#include "rig/capture/switch_witness.h"

#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr int most_bands = 48;
/// A share that noise blurs by more than this part of the tolerance tells nothing.
constexpr double blur = 0.2;
/// How far from a band's middle its light may have its centre, as a share of the band.
constexpr double uneven_rows = 0.5;
/// Standard deviations that noise hardly ever reaches.
constexpr double clear = 4.5;
/// A part of the light that a lie of just over the tolerance changes by more than the tolerance and its noise.
constexpr double telling = 1.3;

struct Shares {
    double before = 0.0;
    double after = 0.0;
    double after_sigma = 0.0;
    double before_sigma = 0.0;
    bool solved = false;
};

/// Least squares over a band: spoiled = before's share of one light + after's share of the other.
class BandFit {
public:
    void add(double before, double after, double spoiled, double variance) {
        bb_ += before * before / variance;
        aa_ += after * after / variance;
        ab_ += before * after / variance;
        bs_ += before * spoiled / variance;
        as_ += after * spoiled / variance;
    }

    /// Lights that look alike cannot be told apart: not solved.
    Shares solve() const {
        Shares shares;
        if (bb_ <= 0 || aa_ <= 0) {
            const double own = std::max(bb_, aa_);
            if (own <= 0) return shares;
            (bb_ > 0 ? shares.before : shares.after) = (bb_ > 0 ? bs_ : as_) / own;
            (bb_ > 0 ? shares.before_sigma : shares.after_sigma) = 1 / std::sqrt(own);
            shares.solved = true;
            return shares;
        }
        const double determinant = bb_ * aa_ - ab_ * ab_;
        if (determinant <= 1e-9 * bb_ * aa_) return shares;
        shares.before = (bs_ * aa_ - as_ * ab_) / determinant;
        shares.after = (as_ * bb_ - bs_ * ab_) / determinant;
        shares.before_sigma = std::sqrt(aa_ / determinant);
        shares.after_sigma = std::sqrt(bb_ / determinant);
        shares.solved = true;
        return shares;
    }

private:
    double bb_ = 0, aa_ = 0, ab_ = 0, bs_ = 0, as_ = 0;
};

Shares shares_of_rows(const WitnessPictures& p, const NoiseModel& noise, double full_scale, int first, int last) {
    BandFit fit;
    const auto columns = static_cast<std::size_t>(p.dark->columns);
    for (std::size_t i = static_cast<std::size_t>(first) * columns; i < static_cast<std::size_t>(last) * columns; ++i) {
        const auto light = [&](const Picture* picture) {
            return picture ? static_cast<double>(picture->samples[i]) - p.dark->samples[i] : 0.0;
        };
        const bool clipped = (p.before && p.before->samples[i] >= full_scale) ||
                             (p.after && p.after->samples[i] >= full_scale) || p.spoiled->samples[i] >= full_scale;
        if (clipped) continue;
        const double before = light(p.before), after = light(p.after), spoiled = light(p.spoiled);
        // Noise of the spoiled frame, and of the two it is compared with; all have the dark frame's as well.
        fit.add(before, after, spoiled, 2 * noise.variance(std::max({before, after, spoiled})));
    }
    return fit.solve();
}

/// What a band is expected to hold. Rows of a rolling shutter change from one to the next: `blur` is how much that may
/// shift the band's share, depending on which of its rows are bright.
struct BandExpectation {
    LightShares shares;
    double blur = 0.0;
};

BandExpectation expect(const ExpectedShares& expected, int first, int last, int rows) {
    const auto at = [&](double row) { return expected(rows > 1 ? row / (rows - 1) : 0.0); };
    const LightShares top = at(first), middle = at((first + last - 1) / 2.0), bottom = at(last - 1);
    const auto blur_of = [](double a, double b, double c) {
        return uneven_rows * std::abs(c - a) + std::abs((a + c) / 2 - b);
    };
    return {middle, std::max(blur_of(top.before, middle.before, bottom.before),
                             blur_of(top.after, middle.after, bottom.after))};
}

}  // namespace

WitnessReport hear_witness(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale,
                           const ExpectedShares& expected, const WitnessTolerance& tolerance) {
    WitnessReport report;
    const int rows = pictures.dark->rows;
    const int bands = std::min(most_bands, rows);
    for (int band = 0; band < bands; ++band) {
        const int first = rows * band / bands, last = rows * (band + 1) / bands;
        const Shares seen = shares_of_rows(pictures, noise, full_scale, first, last);
        const double most_sigma = blur * std::min(tolerance.late, tolerance.early);
        if (!seen.solved || std::max(seen.before_sigma, seen.after_sigma) > most_sigma) continue;
        const BandExpectation claimed = expect(expected, first, last, rows);
        const WitnessTolerance allowed{tolerance.late + claimed.blur, tolerance.early + claimed.blur};
        for (const double late : {pictures.before ? seen.before - claimed.shares.before : 0.0,
                                  pictures.after ? claimed.shares.after - seen.after : 0.0}) {
            report.latest = std::max(report.latest, late);
            report.earliest = std::max(report.earliest, -late);
            report.agrees = report.agrees && late <= allowed.late && -late <= allowed.early;
        }
        const double part = pictures.after ? claimed.shares.after : 1 - claimed.shares.before;
        report.informative = report.informative || (claimed.blur <= tolerance.early && part >= telling * allowed.late &&
                                                    part <= 1 - telling * allowed.early);
    }
    return report;
}

BandLights compare_bands(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale) {
    BandLights lights;
    const int rows = pictures.dark->rows;
    const int bands = std::min(most_bands, rows);
    for (int band = 0; band < bands; ++band) {
        const Shares seen = shares_of_rows(pictures, noise, full_scale, rows * band / bands, rows * (band + 1) / bands);
        if (!seen.solved) continue;
        lights.most_before = std::max(lights.most_before, seen.before - clear * seen.before_sigma);
        lights.most_missing = std::max(lights.most_missing, std::abs(1 - seen.after) - clear * seen.after_sigma);
    }
    return lights;
}

}  // namespace darkbox
