#include "processing/transfer/refine_row.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "processing/transfer/counter_hash.h"

// Highway compiles this file once for each kind of processor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "processing/transfer/refine_row.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace darkbox {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
#if HWY_TARGET != HWY_SCALAR
using Bytes = hn::CappedTag<std::uint8_t, 32>;
using Words = hn::Repartition<std::int16_t, Bytes>;
using Sums = hn::Repartition<std::int32_t, Bytes>;
#endif

/// Rows of patches are compared in runs of so many bytes.
constexpr int run = 32;
constexpr int most_runs = 5;
constexpr int largest_window = 15;
constexpr int near = 2;  ///< how far away the neighbours are whose patches vote

/// The target's patch around a pixel, and which of its bytes count.
struct Patch {
    alignas(64) std::array<std::uint8_t, largest_window * most_runs * run> value;
    alignas(64) std::array<std::uint8_t, largest_window * most_runs * run> counts;
};

class RowRefiner {
public:
    explicit RowRefiner(const Refinement& refinement)
        : r_(refinement),
          half_(refinement.window / 2),
          channels_(refinement.source_bytes.channels()),
          row_bytes_(refinement.window * channels_),
          runs_((row_bytes_ + run - 1) / run) {
        for (int j = 0; j < r_.window; ++j) std::fill_n(whole_row(whole_.data(), j), row_bytes_, std::uint8_t{255});
        const auto step = [](cv::Point by, const TexelBytes& bytes) { return by.y * bytes.pitch() + by.x; };
        for (std::size_t i = 0; i < neighbours.size(); ++i) {
            target_step_[i] = step(neighbours[i], r_.target_bytes);
            source_step_[i] = step(neighbours[i], r_.source_bytes);
        }
        std::size_t around = 0;
        for (int j = -near; j <= near; ++j)
            for (int i = -near; i <= near; ++i) {
                if (i == 0 && j == 0) continue;
                target_around_[around] = step({i, j}, r_.target_bytes);
                source_around_[around++] = step({i, j}, r_.source_bytes);
            }
    }

    int pixel(cv::Point p) {
        const auto random = [&](std::uint64_t n) {
            return counter_hash(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y), r_.random + n);
        };
        // Far away in memory: asked for now, needed only later.
        const int alike = r_.source_bytes.place(r_.table.pick(r_.bin(p), random(0)));
        hwy::Prefetch(r_.source_bytes.at(alike));
        const int* at = r_.places.data() + r_.target_bytes.place(p);
        read_patch(p);
        take_vote(at);
        pull_ = r_.balance.pull(p.x, p.y);
        for (std::size_t i = 0; i < neighbours.size(); ++i) continued_[i] = at[target_step_[i]] - source_step_[i];
        best_ = *at;
        least_ = cost(best_, std::numeric_limits<float>::infinity());
        tried_count_ = 0;
        tried_[tried_count_++] = best_;
        for (const int continued : continued_) consider(continued, 1);
        consider(alike, r_.incoherence);
        for (std::uint64_t i = 1; i <= 2; ++i) {
            // Beyond an end of its row a step goes on at the other end: as good a guess.
            const int guess = best_ + random_step(random(i));
            if (guess >= 0 && guess < r_.source_bytes.places()) consider(guess, r_.incoherence);
        }
        return best_;
    }

private:
    inline static const std::array<cv::Point, 12> neighbours{cv::Point{-1, 0}, {1, 0},  {0, -1}, {0, 1},
                                                             {-1, -1},         {1, -1}, {-1, 1}, {1, 1},
                                                             {-2, 0},          {2, 0},  {0, -2}, {0, 2}};

    const Refinement& r_;
    int half_;
    int channels_;
    int row_bytes_;
    int runs_;
    Patch patch_{};
    alignas(64) std::array<std::uint8_t, largest_window * most_runs * run> whole_{};
    const std::uint8_t* counts_ = nullptr;
    std::array<float, 3> vote_{};
    float vote_weight_ = 0;
    cv::Vec3f pull_;
    std::array<int, 12> target_step_;
    std::array<int, 12> source_step_;
    std::array<int, 24> target_around_;  ///< steps to the neighbours whose patches vote
    std::array<int, 24> source_around_;
    std::array<int, 12> continued_;  ///< what continues the neighbours' patches; for those outside not in the source
    int best_ = 0;
    float least_ = 0;
    std::array<int, 16> tried_;
    std::size_t tried_count_ = 0;

    template <class Byte>
    Byte* whole_row(Byte* rows, int j) const {
        return rows + static_cast<std::ptrdiff_t>(j) * runs_ * run;
    }

    void read_patch(cv::Point p) {
        for (int j = 0; j < r_.window; ++j)
            std::memcpy(whole_row(patch_.value.data(), j), r_.target_bytes.at({p.x - half_, p.y + j - half_}),
                        static_cast<std::size_t>(runs_) * run);
        counts_ = r_.whole(p) ? whole_.data() : counted(p);
    }

    /// What lies outside the target does not count.
    const std::uint8_t* counted(cv::Point p) {
        for (int j = 0; j < r_.window; ++j) {
            std::uint8_t* row = whole_row(patch_.counts.data(), j);
            std::fill_n(row, runs_ * run, std::uint8_t{0});
            for (int i = 0; i < r_.window; ++i)
                if (r_.target.has({p.x + i - half_, p.y + j - half_}))
                    std::fill_n(row + static_cast<std::ptrdiff_t>(i) * channels_, channels_, std::uint8_t{255});
        }
        return patch_.counts.data();
    }

    /// Bytes that are not there are 0 and do not count.
    void take_vote(const int* at) {
        std::uint32_t red_blue = 0;
        std::uint32_t green = 0;
        int count = 0;
        for (std::size_t i = 0; i < target_around_.size(); ++i) {
            const int place = at[target_around_[i]] - source_around_[i];
            std::uint32_t rgb = 0;
            std::memcpy(&rgb, r_.source_bytes.at(place), sizeof rgb);
            red_blue += rgb & 0xff00ffU;
            green += rgb >> 8 & 0xffU;
            count += r_.source_bytes.has(place) ? 1 : 0;
        }
        vote_weight_ = count > 0 ? r_.vote_weight : 0;
        if (count == 0) return;
        const std::array<std::uint32_t, 3> sum{red_blue & 0xffffU, green, red_blue >> 16};
        std::uint8_t* centre = whole_row(patch_.value.data(), half_) + static_cast<std::ptrdiff_t>(half_) * channels_;
        for (std::size_t c = 0; c < 3; ++c) {
            vote_[c] = static_cast<float>(sum[c]) / static_cast<float>(count);
            centre[c] = static_cast<std::uint8_t>(vote_[c] + 0.5F);
        }
    }

    int random_step(std::uint32_t random) const {
        const int radius = 2 << ((random >> 28) % 5);
        const std::uint32_t span = static_cast<std::uint32_t>(2 * radius + 1);
        const int x = static_cast<int>(((random & 0x3fffU) * span) >> 14) - radius;
        const int y = static_cast<int>(((random >> 14 & 0x3fffU) * span) >> 14) - radius;
        return y * r_.source_bytes.pitch() + x;
    }

    void consider(int source, float factor) {
        if (!r_.source_bytes.has(source)) return;
        for (std::size_t i = 0; i < tried_count_; ++i)
            if (tried_[i] == source) return;
        tried_[tried_count_++] = source;
        const float now = cost(source, least_ / factor) * factor;
        if (now >= least_) return;
        least_ = now;
        best_ = source;
    }

    /// At least `limit` where it is not less than that.
    float cost(int source, float limit) const {
        const std::uint8_t* rgb = r_.source_bytes.at(source);
        float apart = r_.balance.cost(source);
        for (int c = 0; c < 3; ++c) {
            const auto value = static_cast<float>(rgb[c]);
            const float off = value - vote_[static_cast<std::size_t>(c)];
            apart += vote_weight_ * off * off + pull_[c] * value;
        }
        for (std::size_t i = 0; i < 4; ++i) apart += source == continued_[i] ? 0 : r_.cut;
        if (apart >= limit) return apart;
        const float left = std::min(limit - apart, 1e9F);
        return apart + static_cast<float>(difference(source, static_cast<std::int32_t>(left) + 1));
    }

    /// Sum of squared byte differences of the patches; may stop in the middle once it is at least `limit`.
    std::int32_t difference(int source, std::int32_t limit) const {
        const std::uint8_t* s = r_.source_bytes.at(source - half_ * (r_.source_bytes.pitch() + 1));
        const std::size_t stride = r_.source_bytes.stride();
        const int middle = (r_.window + 1) / 2;
        const std::int32_t first = rows_difference(s, stride, 0, middle);
        if (first >= limit) return first;
        return first + rows_difference(s, stride, middle, r_.window);
    }

#if HWY_TARGET == HWY_SCALAR
    std::int32_t rows_difference(const std::uint8_t* source, std::size_t stride, int begin, int end) const {
        std::int32_t sum = 0;
        for (int j = begin; j < end; ++j) {
            const std::uint8_t* s = source + static_cast<std::size_t>(j) * stride;
            const std::uint8_t* t = whole_row(patch_.value.data(), j);
            const std::uint8_t* m = whole_row(counts_, j);
            for (int i = 0; i < row_bytes_; ++i) {
                const int off = m[i] ? s[i] - t[i] : 0;
                sum += off * off;
            }
        }
        return sum;
    }
#else
    std::int32_t rows_difference(const std::uint8_t* source, std::size_t stride, int begin, int end) const {
        return runs_ == 1 ? runs_difference<1>(source, stride, begin, end)
                          : runs_difference<most_runs>(source, stride, begin, end);
    }

    /// `Most` runs of a row at most: the compiler unrolls what is known to be one.
    template <int Most>
    HWY_INLINE std::int32_t runs_difference(const std::uint8_t* source, std::size_t stride, int begin, int end) const {
        const Bytes bytes;
        const Words words;
        const Sums sums;
        auto even = hn::Zero(sums);
        auto odd = hn::Zero(sums);
        const int runs = Most == 1 ? 1 : runs_;
        const std::size_t length = static_cast<std::size_t>(runs) * run;
        const std::uint8_t* t = patch_.value.data() + static_cast<std::size_t>(begin) * length;
        const std::uint8_t* m = counts_ + static_cast<std::size_t>(begin) * length;
        for (int j = begin; j < end; ++j, t += length, m += length) {
            const std::uint8_t* s = source + static_cast<std::size_t>(j) * stride;
            for (std::size_t i = 0; i < length; i += hn::Lanes(bytes)) {
                const auto a = hn::LoadU(bytes, s + i);
                const auto b = hn::Load(bytes, t + i);
                const auto off =
                    hn::And(hn::Or(hn::SaturatedSub(a, b), hn::SaturatedSub(b, a)), hn::Load(bytes, m + i));
                const auto zero = hn::Zero(bytes);
                const auto low = hn::BitCast(words, hn::InterleaveLower(bytes, off, zero));
                const auto high = hn::BitCast(words, hn::InterleaveUpper(bytes, off, zero));
                even = hn::ReorderWidenMulAccumulate(sums, low, low, even, odd);
                even = hn::ReorderWidenMulAccumulate(sums, high, high, even, odd);
            }
        }
        return hn::GetLane(hn::SumOfLanes(sums, hn::Add(even, odd)));
    }
#endif
};

void refine_row(const Refinement& refinement, int y, int first, int* refined) {
    RowRefiner refiner(refinement);
    for (int x = first; x < refinement.target.valid.cols; x += 2)
        if (refinement.target.valid(y, x)) refined[x] = refiner.pixel({x, y});
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(refine_row);

void refine_row(const Refinement& refinement, int y, int first, int* refined) {
    HWY_DYNAMIC_DISPATCH(refine_row)(refinement, y, first, refined);
}

}  // namespace darkbox
#endif
