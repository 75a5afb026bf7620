#include "processing/transfer/refinement.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "processing/texels/random.h"
#include "processing/transfer/appearance.h"
#include "processing/transfer/kd_tree.h"
#include "processing/transfer/patch_energy.h"
#include "processing/transfer/similar_pixels.h"

namespace darkbox {
namespace {

/// Groups of pixels that change one after the other: every third column of every third row.
constexpr int group_step = 3;
/// How far the colour that a normal is expected to have is a mean over the source, pixels of the finest level.
constexpr double look_blur = 6;
/// Use is compared with what is expected within about so many source pixels, and pixel by pixel.
constexpr double use_blur = 2;
/// Weights of the energy's terms against a squared difference of colours in 8-bit units; see docs/decisions/0022.
constexpr float normal_cost = 1.8F;
constexpr float seam_cost = 3;
constexpr float pixel_use_cost = 35;
constexpr float use_cost = 400;
constexpr int random_candidates = 2;
constexpr int look_jitter = 4;
/// Added to the expected use, in target pixels, so that what is hardly expected is not forbidden.
constexpr float use_floor = 0.3F;
constexpr float blurred_use_floor = 0.05F;

/// Invalid pixels show the nearest valid one, so that windows across the border can be compared.
cv::Mat completed(const cv::Mat& bytes, const cv::Mat1b& valid) {
    cv::Mat1b invalid;
    cv::bitwise_not(valid, invalid);
    cv::Mat1f distance;
    cv::Mat1i label;
    cv::distanceTransform(invalid, distance, label, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
    std::vector<cv::Point> of_label(valid.total() + 1);
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x)
            if (valid(y, x)) of_label[static_cast<std::size_t>(label(y, x))] = {x, y};
    cv::Mat result = bytes.clone();
    const auto size = static_cast<std::ptrdiff_t>(bytes.elemSize());
    for (int y = 0; y < valid.rows; ++y)
        for (int x = 0; x < valid.cols; ++x) {
            const cv::Point from = of_label[static_cast<std::size_t>(label(y, x))];
            if (!valid(y, x)) std::copy_n(bytes.ptr(from.y, from.x), size, result.ptr(y, x));
        }
    return result;
}

cv::Mat bordered(const cv::Mat& bytes, int border) {
    cv::Mat result;
    cv::copyMakeBorder(bytes, result, border, border, border, border, cv::BORDER_REPLICATE);
    return result;
}

cv::Mat bytes_of(const MapLevel& level, float white) {
    const AlbedoMap albedo{level.albedo, level.valid};
    return completed(joint_patches(appearance_of({level.normal, level.valid}, albedo, white), 1).bytes, level.valid);
}

/// The mean of the valid pixels under a Gaussian.
cv::Mat3f blurred_colours(const cv::Mat3b& picture, const cv::Mat1b& valid, double sigma) {
    cv::Mat3f all;
    picture.convertTo(all, CV_32F);
    cv::Mat3f colour(picture.size(), cv::Vec3f(0, 0, 0));
    all.copyTo(colour, valid);
    cv::Mat1f weight;
    valid.convertTo(weight, CV_32F, 1 / 255.0);
    cv::GaussianBlur(colour, colour, cv::Size(), sigma, sigma);
    cv::GaussianBlur(weight, weight, cv::Size(), sigma, sigma);
    for (int y = 0; y < picture.rows; ++y)
        for (int x = 0; x < picture.cols; ++x) colour(y, x) *= 1 / std::max(weight(y, x), 1e-6F);
    return colour;
}

/// Three channels are colours, three are normals.
constexpr int channels = 6;

class Refinement {
public:
    Refinement(const RefinementLevel& level, const cv::Mat2i& coordinates, const TransferOptions& options)
        : level_(level),
          options_(options),
          radius_(options.window / 2),
          window_numbers_(3.0F * static_cast<float>(options.window * options.window)),
          coordinates_(coordinates.clone()),
          source_(bordered(bytes_of(level.source, level.white), radius_)),
          target_(bordered(bytes_of(level.target, level.white), radius_)),
          similar_(source_, level.source.valid, options.window, options.seed),
          used_(level.source.valid.size(), 0) {
        cv::copyMakeBorder(level.target.valid, target_valid_, radius_, radius_, radius_, radius_, cv::BORDER_CONSTANT,
                           cv::Scalar(0));
        whole_ = inner_pixels(level.target.valid, radius_);
        const AlbedoMap albedo{level.source.albedo, level.source.valid};
        const Appearance shown = appearance_of({level.source.normal, level.source.valid}, albedo, level.white);
        source_colour_ = blurred_colours(shown.picture, level.source.valid, std::ldexp(look_blur, -level.level));
        expected_use_ = ExpectedLook(shown).expected_use(shown, {level.target.normal, level.target.valid});
        cv::GaussianBlur(expected_use_, blurred_expected_use_, cv::Size(), use_blur, use_blur);
        find_pixels_by_normal();
        for_each_target([&](cv::Point p) { place(p, cv::Point(coordinates_(p))); });
    }

    void pass(int number) {
        for (int group = 0; group < group_step * group_step; ++group) change_group(number, group);
    }

    const cv::Mat2i& coordinates() const { return coordinates_; }

private:
    struct Change {
        cv::Point target;
        cv::Point source;
    };

    /// What the windows around a pixel's neighbours say about its own colour.
    struct Votes {
        cv::Vec3f mean{0, 0, 0};
        float count = 0;
    };

    const RefinementLevel& level_;
    const TransferOptions& options_;
    int radius_;
    float window_numbers_;
    cv::Mat2i coordinates_;
    cv::Mat source_;          ///< colours and normals, with a border of the radius
    cv::Mat target_;          ///< likewise, as they are now
    cv::Mat1b target_valid_;  ///< with that border
    cv::Mat1b whole_;         ///< target pixels whose whole window is valid
    SimilarPixels similar_;
    cv::Mat3f source_colour_;
    cv::Mat2i by_normal_;  ///< for each target pixel, a source pixel of nearly its normal
    cv::Mat1f expected_use_;
    cv::Mat1f blurred_expected_use_;
    cv::Mat1i used_;
    cv::Mat1f excess_;  ///< use of a source pixel's surroundings over what is expected, less 1

    template <class Visit>
    void for_each_target(const Visit& visit) const {
        for (int y = 0; y < level_.target.valid.rows; ++y)
            for (int x = 0; x < level_.target.valid.cols; ++x)
                if (level_.target.valid(y, x)) visit(cv::Point(x, y));
    }

    const std::uint8_t* source_at(cv::Point p) const { return source_.ptr(p.y + radius_, p.x + radius_); }

    void find_pixels_by_normal() {
        PointSet points;
        points.dimensions = 3;
        std::vector<cv::Point> pixels;
        cv::findNonZero(level_.source.valid, pixels);
        for (const cv::Point& p : pixels)
            points.coordinates.insert(points.coordinates.end(), level_.source.normal(p).val,
                                      level_.source.normal(p).val + 3);
        const KdTree tree(points);
        by_normal_.create(level_.target.valid.size());
        tbb::parallel_for(0, by_normal_.rows, [&](int y) {
            constexpr int most_leaves = 64;
            std::vector<Match> matches;
            for (int x = 0; x < by_normal_.cols; ++x) {
                if (!level_.target.valid(y, x)) continue;
                tree.nearest(level_.target.normal(y, x).val, 1, std::numeric_limits<float>::infinity(), most_leaves,
                             matches);
                const cv::Point& found = pixels[static_cast<std::size_t>(matches.front().point)];
                by_normal_(y, x) = cv::Vec2i(found.x, found.y);
            }
        });
    }

    void place(cv::Point p, cv::Point source) {
        coordinates_(p) = cv::Vec2i(source.x, source.y);
        ++used_(source);
        std::copy_n(source_at(source), 3, target_.ptr(p.y + radius_, p.x + radius_));
    }

    void change_group(int pass, int group) {
        compare_use();
        const cv::Point first(group % group_step, group / group_step);
        const int rows = (coordinates_.rows - first.y + group_step - 1) / group_step;
        std::vector<std::vector<Change>> changes(static_cast<std::size_t>(std::max(0, rows)));
        tbb::parallel_for(0, rows, [&](int row) {
            std::vector<cv::Point> candidates;
            const int y = first.y + row * group_step;
            for (int x = first.x; x < coordinates_.cols; x += group_step) {
                if (!level_.target.valid(y, x)) continue;
                const cv::Point source = best({x, y}, pass, candidates);
                if (source != cv::Point(coordinates_(y, x)))
                    changes[static_cast<std::size_t>(row)].push_back({{x, y}, source});
            }
        });
        for (const std::vector<Change>& row : changes)
            for (const Change& change : row) {
                --used_(cv::Point(coordinates_(change.target)));
                place(change.target, change.source);
            }
    }

    void compare_use() {
        used_.convertTo(excess_, CV_32F);
        cv::GaussianBlur(excess_, excess_, cv::Size(), use_blur, use_blur);
        for (int y = 0; y < excess_.rows; ++y)
            for (int x = 0; x < excess_.cols; ++x)
                excess_(y, x) = excess_(y, x) / (blurred_expected_use_(y, x) + blurred_use_floor) - 1;
    }

    void add(cv::Point source, std::vector<cv::Point>& candidates) const {
        if (level_.source.has(source) && std::find(candidates.begin(), candidates.end(), source) == candidates.end())
            candidates.push_back(source);
    }

    void collect(cv::Point p, int pass, std::vector<cv::Point>& candidates) const {
        const cv::Point now(coordinates_(p));
        candidates.clear();
        add(now, candidates);
        for (int dy = -radius_; dy <= radius_; ++dy)
            for (int dx = -radius_; dx <= radius_; ++dx) {
                const cv::Point offset(dx, dy);
                if (!level_.target.has(p + offset)) continue;
                const cv::Point source(coordinates_(p + offset));
                add(source - offset, candidates);
                if (std::abs(dx) <= 1 && std::abs(dy) <= 1)
                    for (const cv::Point& like : similar_.of(source)) add(like - offset, candidates);
            }
        const auto place = static_cast<std::uint64_t>(p.y) * static_cast<std::uint64_t>(coordinates_.cols) +
                           static_cast<std::uint64_t>(p.x);
        SplitMix64 seed(options_.seed + static_cast<std::uint64_t>(level_.level * 1024 + pass));
        SplitMix64 random(seed.next() ^ place);
        const auto within = [&](int reach) { return static_cast<int>(random.uniform() * (2 * reach + 1)) - reach; };
        const auto jitter = [&](int reach) {
            const int x = within(reach);
            return cv::Point(x, within(reach));
        };
        add(cv::Point(by_normal_(p)) + jitter(look_jitter), candidates);
        int reach = std::max(level_.source.valid.cols, level_.source.valid.rows) / 4;
        for (int i = 0; i < random_candidates; ++i, reach = std::max(2, reach / 4))
            add(now + jitter(reach), candidates);
    }

    Votes votes(cv::Point p) const {
        Votes result;
        for (int dy = -radius_; dy <= radius_; ++dy)
            for (int dx = -radius_; dx <= radius_; ++dx) {
                const cv::Point offset(dx, dy);
                if ((dx == 0 && dy == 0) || !level_.target.has(p + offset)) continue;
                const std::uint8_t* colour = source_at(cv::Point(coordinates_(p + offset)) - offset);
                result.mean += cv::Vec3f(colour[0], colour[1], colour[2]);
                result.count += 1;
            }
        if (result.count > 0) result.mean *= 1 / result.count;
        return result;
    }

    /// Sum over the four neighbours of the RMS difference to the source's own continuation, both ways. Not squared:
    /// what counts is that a cut is there.
    float seams(cv::Point p, cv::Point source) const {
        constexpr std::array<std::array<int, 2>, 4> steps{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
        float sum = 0;
        for (const auto& [dx, dy] : steps) {
            const cv::Point step(dx, dy);
            if (!level_.target.has(p + step)) continue;
            const cv::Point beside(coordinates_(p + step));
            if (beside == source + step) continue;
            int square = 0;
            for (int c = 0; c < 3; ++c) {
                const int there = source_at(source + step)[c] - source_at(beside)[c];
                const int here = source_at(beside - step)[c] - source_at(source)[c];
                square += there * there + here * here;
            }
            sum += std::sqrt(static_cast<float>(square) / 6);
        }
        return sum;
    }

    cv::Point best(cv::Point p, int pass, std::vector<cv::Point>& candidates) const {
        collect(p, pass, candidates);
        const Votes vote = votes(p);
        const cv::Vec3f expected = level_.look.colour(level_.target.normal(p));
        const cv::Point now(coordinates_(p));
        cv::Point nearest = now;
        float least = std::numeric_limits<float>::infinity();
        for (const cv::Point& source : candidates) {
            const std::uint8_t* colour = source_at(source);
            const cv::Vec3f off = cv::Vec3f(colour[0], colour[1], colour[2]) - vote.mean;
            const cv::Vec3f tint = source_colour_(source) - expected;
            const int others = used_(source) - (source == now ? 1 : 0);
            const float use = static_cast<float>(others) / (expected_use_(source) + use_floor);
            const float use_energy = pixel_use_cost * use + use_cost * excess_(source);
            const float rest = vote.count * off.dot(off) / window_numbers_ + seam_cost * seams(p, source) +
                               static_cast<float>(options_.colour_weight) * tint.dot(tint) / 3 +
                               static_cast<float>(options_.evenness) * use_energy;
            if (rest >= least) continue;
            const float energy = rest + difference(p, source, least - rest);
            if (energy < least) {
                least = energy;
                nearest = source;
            }
        }
        return nearest;
    }

    /// Mean square over the window, per number of one layer; may stop at more than `limit`.
    float difference(cv::Point p, cv::Point source, float limit) const {
        const float normals = normal_cost * static_cast<float>(options_.normal_weight);
        if (!whole_(p)) return difference_at_border(p, source);
        const float most = limit * window_numbers_;
        float sum = 0;
        for (int dy = 0; dy < options_.window && sum < most; ++dy) {
            const std::uint8_t* s = source_.ptr(source.y + dy, source.x);
            const std::uint8_t* t = target_.ptr(p.y + dy, p.x);
            std::array<int, channels> sums{};
            for (int i = 0; i < options_.window; ++i)
                for (int c = 0; c < channels; ++c) {
                    const int d = s[i * channels + c] - t[i * channels + c];
                    sums[static_cast<std::size_t>(c)] += d * d;
                }
            sum += static_cast<float>(sums[0] + sums[1] + sums[2]) +
                   normals * static_cast<float>(sums[3] + sums[4] + sums[5]);
        }
        return sum / window_numbers_;
    }

    float difference_at_border(cv::Point p, cv::Point source) const {
        const float normals = normal_cost * static_cast<float>(options_.normal_weight);
        float sum = 0;
        float numbers = 0;
        for (int dy = 0; dy < options_.window; ++dy)
            for (int dx = 0; dx < options_.window; ++dx) {
                if (!target_valid_(p.y + dy, p.x + dx)) continue;
                const std::uint8_t* s = source_.ptr(source.y + dy, source.x + dx);
                const std::uint8_t* t = target_.ptr(p.y + dy, p.x + dx);
                numbers += 3;
                for (int c = 0; c < channels; ++c) {
                    const auto d = static_cast<float>(s[c] - t[c]);
                    sum += c < 3 ? d * d : normals * d * d;
                }
            }
        return sum / numbers;
    }
};

}  // namespace

cv::Mat2i refine_level(const RefinementLevel& level, const cv::Mat2i& coordinates, const TransferOptions& options,
                       const PassBegins& pass_begins) {
    if (options.passes == 0) return coordinates;
    Refinement refinement(level, coordinates, options);
    for (int pass = 0; pass < options.passes; ++pass) {
        pass_begins();
        refinement.pass(pass);
    }
    for (int y = 0; y < coordinates.rows; ++y)
        for (int x = 0; x < coordinates.cols; ++x)
            if (level.target.valid(y, x))
                level.target.albedo(y, x) = level.source.albedo(cv::Point(refinement.coordinates()(y, x)));
    return refinement.coordinates();
}

}  // namespace darkbox
