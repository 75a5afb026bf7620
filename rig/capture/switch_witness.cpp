#include "rig/capture/switch_witness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace darkbox {
namespace {

constexpr int usual_bands = 48;
/// Where a rolling shutter exposes the rows of a band too far apart, there are more bands, until their rows differ by
/// this part of the tolerance.
constexpr double alike = 0.5;
/// A share that noise blurs by more than this part of the tolerance tells nothing.
constexpr double blur = 0.2;
/// How far from a band's middle its light may have its centre, as a share of the band.
constexpr double uneven_rows = 0.5;
/// Standard deviations that noise hardly ever reaches.
constexpr double clear = 4.5;
/// A part of the light that a lie of just over the tolerance changes by more than the tolerance and its noise.
constexpr double telling = 1.3;

/// How much of the normal equations must be light and not noise.
constexpr double least_clean = 0.5;

struct Shares {
    double before = 0.0;
    double after = 0.0;
    double after_sigma = 0.0;
    double before_sigma = 0.0;
    bool solved = false;
};

/// What the pictures hold at one sample, without the dark.
struct Sample {
    double before = 0.0;
    double after = 0.0;
    double spoiled = 0.0;
};

/// Least squares over a band: spoiled = before's share of one light + after's share of the other. The two lights are
/// noisy themselves, and all three have the dark frame's noise in common; what that adds to the normal equations is
/// known and taken off (Fuller, "Measurement Error Models", 1987, section 2.2). Without that, rows in which there is
/// little light, or two lights are alike, would seem to hold some of each.
class BandFit {
public:
    explicit BandFit(const NoiseModel& noise) : noise_(noise) {}

    void add(const Sample& s) {
        // Of the spoiled frame, and of the light that it is compared with.
        const double weight = 1 / (2 * noise_.variance(std::max({s.before, s.after, s.spoiled})));
        const double dark = weight * noise_.variance(0);
        raw_ += weight *
                Eigen::Matrix2d{{s.before * s.before, s.before * s.after}, {s.before * s.after, s.after * s.after}};
        noisy_ += Eigen::Matrix2d{{weight * noise_.variance(s.before) + dark, dark},
                                  {dark, weight * noise_.variance(s.after) + dark}};
        right_ += weight * s.spoiled * Eigen::Vector2d(s.before, s.after) - Eigen::Vector2d(dark, dark);
    }

    /// One light alone; the other share is 0.
    Shares solve_one(int light) const {
        Shares shares;
        const double raw = raw_(light, light), clean = raw - noisy_(light, light);
        if (clean < least_clean * raw || raw <= 0) return shares;
        (light == 0 ? shares.before : shares.after) = right_(light) / clean;
        (light == 0 ? shares.before_sigma : shares.after_sigma) = std::sqrt(raw) / clean;
        shares.solved = true;
        return shares;
    }

    /// Lights that noise alone could tell apart cannot be: not solved.
    Shares solve_both() const {
        Shares shares;
        const Eigen::Matrix2d clean = raw_ - noisy_;
        if (raw_.determinant() <= 0 || clean(0, 0) <= 0 || clean.determinant() < least_clean * raw_.determinant())
            return shares;
        const Eigen::Matrix2d inverse = clean.inverse();
        const Eigen::Vector2d solution = inverse * right_;
        const Eigen::Matrix2d covariance = inverse * raw_ * inverse;
        shares.before = solution(0);
        shares.after = solution(1);
        shares.before_sigma = std::sqrt(covariance(0, 0));
        shares.after_sigma = std::sqrt(covariance(1, 1));
        shares.solved = true;
        return shares;
    }

private:
    const NoiseModel& noise_;
    Eigen::Matrix2d raw_ = Eigen::Matrix2d::Zero();
    Eigen::Matrix2d noisy_ = Eigen::Matrix2d::Zero();  ///< what noise is expected to have added to it
    Eigen::Vector2d right_ = Eigen::Vector2d::Zero();
};

struct Band {
    int first = 0;
    int last = 0;  ///< row after it
    double middle() const { return (first + last - 1) / 2.0; }
};
Band band_of(int rows, int band, int bands) { return {rows * band / bands, rows * (band + 1) / bands}; }

Shares shares_of_rows(const WitnessPictures& p, const NoiseModel& noise, double full_scale, const Band& band) {
    BandFit fit(noise);
    const auto columns = static_cast<std::size_t>(p.dark->columns);
    const auto last = static_cast<std::size_t>(band.last) * columns;
    for (std::size_t i = static_cast<std::size_t>(band.first) * columns; i < last; ++i) {
        const auto light = [&](const Picture* picture) {
            return picture ? static_cast<double>(picture->samples[i]) - p.dark->samples[i] : 0.0;
        };
        const bool clipped = (p.before && p.before->samples[i] >= full_scale) ||
                             (p.after && p.after->samples[i] >= full_scale) || p.spoiled->samples[i] >= full_scale;
        if (clipped) continue;
        fit.add({light(p.before), light(p.after), light(p.spoiled)});
    }
    if (p.before && p.after) return fit.solve_both();
    return fit.solve_one(p.before ? 0 : 1);
}

/// What a band is expected to hold. Rows of a rolling shutter change from one to the next: `blur` is how much that may
/// shift the band's share, depending on which of its rows are bright.
struct BandExpectation {
    LightShares shares;
    double blur = 0.0;
};

BandExpectation expect(const ExpectedShares& expected, const Band& band, int rows) {
    const auto at = [&](double row) { return expected(rows > 1 ? row / (rows - 1) : 0.0); };
    const LightShares top = at(band.first), middle = at(band.middle()), bottom = at(band.last - 1);
    const auto blur_of = [](double a, double b, double c) {
        return uneven_rows * std::abs(c - a) + std::abs((a + c) / 2 - b);
    };
    return {middle, std::max(blur_of(top.before, middle.before, bottom.before),
                             blur_of(top.after, middle.after, bottom.after))};
}

WitnessTolerance allowed_in(const BandExpectation& claimed, const WitnessTolerance& tolerance) {
    return {tolerance.late + claimed.blur, tolerance.early + claimed.blur};
}

int bands_of(int rows) { return std::min(usual_bands, rows); }

int bands_for(const ExpectedShares& expected, int rows, const WitnessTolerance& tolerance) {
    const auto blurred = [&](int bands) {
        for (int band = 0; band < bands; ++band)
            if (expect(expected, band_of(rows, band, bands), rows).blur > alike * tolerance.early) return true;
        return false;
    };
    int bands = bands_of(rows);
    while (bands < rows && blurred(bands)) bands = std::min(2 * bands, rows);
    return bands;
}

/// A part of an exposure is expected, large and small enough for lies of just over the tolerance to show.
bool is_telling(const BandExpectation& claimed, bool lit_after, const WitnessTolerance& tolerance) {
    const WitnessTolerance allowed = allowed_in(claimed, tolerance);
    const double part = lit_after ? claimed.shares.after : 1 - claimed.shares.before;
    return claimed.blur <= tolerance.early && part >= telling * allowed.late && part <= 1 - telling * allowed.early;
}

}  // namespace

bool can_tell(const ExpectedShares& expected, int rows, bool lit_after, const WitnessTolerance& tolerance) {
    const int bands = bands_for(expected, rows, tolerance);
    for (int band = 0; band < bands; ++band)
        if (is_telling(expect(expected, band_of(rows, band, bands), rows), lit_after, tolerance)) return true;
    return false;
}

WitnessReport hear_witness(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale,
                           const ExpectedShares& expected, const WitnessTolerance& tolerance) {
    WitnessReport report;
    const int rows = pictures.dark->rows;
    const int bands = bands_for(expected, rows, tolerance);
    for (int band = 0; band < bands; ++band) {
        const Band place = band_of(rows, band, bands);
        const Shares seen = shares_of_rows(pictures, noise, full_scale, place);
        const double most_sigma = blur * std::min(tolerance.late, tolerance.early);
        if (!seen.solved || std::max(seen.before_sigma, seen.after_sigma) > most_sigma) continue;
        const BandExpectation claimed = expect(expected, place, rows);
        const WitnessTolerance allowed = allowed_in(claimed, tolerance);
        for (const double late : {pictures.before ? seen.before - claimed.shares.before : 0.0,
                                  pictures.after ? claimed.shares.after - seen.after : 0.0}) {
            report.latest = std::max(report.latest, late);
            report.earliest = std::max(report.earliest, -late);
            report.agrees = report.agrees && late <= allowed.late && -late <= allowed.early;
        }
        report.informative = report.informative || is_telling(claimed, pictures.after != nullptr, tolerance);
    }
    return report;
}

BandLights compare_bands(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale) {
    BandLights lights;
    const int rows = pictures.dark->rows;
    const int bands = bands_of(rows);
    for (int band = 0; band < bands; ++band) {
        const Shares seen = shares_of_rows(pictures, noise, full_scale, band_of(rows, band, bands));
        if (!seen.solved) continue;
        lights.most_before = std::max(lights.most_before, seen.before - clear * seen.before_sigma);
        lights.most_missing = std::max(lights.most_missing, std::abs(1 - seen.after) - clear * seen.after_sigma);
    }
    return lights;
}

std::vector<BandShare> band_shares(const WitnessPictures& pictures, const NoiseModel& noise, double full_scale) {
    std::vector<BandShare> shares;
    const int rows = pictures.dark->rows;
    const int bands = bands_of(rows);
    for (int band = 0; band < bands; ++band) {
        const Band place = band_of(rows, band, bands);
        const Shares seen = shares_of_rows(pictures, noise, full_scale, place);
        const double height = rows > 1 ? place.middle() / (rows - 1) : 0.0;
        if (seen.solved) shares.push_back({height, seen.after, seen.after_sigma});
    }
    return shares;
}

}  // namespace darkbox
