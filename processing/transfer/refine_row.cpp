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
    }

    cv::Vec2i pixel(cv::Point p) {
        const auto random = [&](std::uint64_t n) {
            return counter_hash(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y), r_.random + n);
        };
        // Far away in memory: asked for now, needed only later.
        const cv::Point alike = r_.table.pick(r_.bin(p), random(0));
        hwy::Prefetch(r_.source_bytes.at(alike));
        read_patch(p);
        take_vote(p);
        pull_ = r_.balance.pull(p.x, p.y);
        read_continuations(p);
        best_ = cv::Point(r_.coordinates(p));
        least_ = cost(best_, std::numeric_limits<float>::infinity());
        tried_count_ = 0;
        tried_[tried_count_++] = best_;
        for (const cv::Point& offset : neighbours)
            if (r_.target.has(p + offset)) consider(cv::Point(r_.coordinates(p + offset)) - offset, 1);
        consider(alike, r_.incoherence);
        for (std::uint64_t i = 1; i <= 2; ++i) consider(best_ + random_offset(random(i)), r_.incoherence);
        return {best_.x, best_.y};
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
    std::array<cv::Point, 4> continued_;
    cv::Point best_;
    float least_ = 0;
    std::array<cv::Point, 24> tried_;
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

    /// Where the patches of the four neighbours go on; nowhere for those outside, which nothing continues.
    void read_continuations(cv::Point p) {
        for (std::size_t i = 0; i < continued_.size(); ++i) {
            const cv::Point offset = neighbours[i];
            continued_[i] = r_.target.has(p + offset) ? cv::Point(r_.coordinates(p + offset)) - offset
                                                      : cv::Point(std::numeric_limits<int>::min(), 0);
        }
    }

    void take_vote(cv::Point p) {
        std::array<int, 3> sum{};
        int count = 0;
        for (int j = -near; j <= near; ++j)
            for (int i = -near; i <= near; ++i) {
                if ((i == 0 && j == 0) || !r_.target.has({p.x + i, p.y + j})) continue;
                const cv::Point at = cv::Point(r_.coordinates(p.y + j, p.x + i)) - cv::Point(i, j);
                if (!r_.source.has(at)) continue;
                const std::uint8_t* rgb = r_.source_bytes.at(at);
                for (std::size_t c = 0; c < 3; ++c) sum[c] += rgb[c];
                ++count;
            }
        vote_weight_ = count > 0 ? r_.vote_weight : 0;
        if (count == 0) return;
        std::uint8_t* centre = whole_row(patch_.value.data(), half_) + static_cast<std::ptrdiff_t>(half_) * channels_;
        for (std::size_t c = 0; c < 3; ++c) {
            vote_[c] = static_cast<float>(sum[c]) / static_cast<float>(count);
            centre[c] = static_cast<std::uint8_t>(vote_[c] + 0.5F);
        }
    }

    static cv::Point random_offset(std::uint32_t random) {
        const int radius = 2 << ((random >> 28) % 5);
        const std::uint32_t span = static_cast<std::uint32_t>(2 * radius + 1);
        return {static_cast<int>((random & 0x3fffU) % span) - radius,
                static_cast<int>((random >> 14 & 0x3fffU) % span) - radius};
    }

    void consider(cv::Point source, float factor) {
        if (!r_.source.has(source)) return;
        for (std::size_t i = 0; i < tried_count_; ++i)
            if (tried_[i] == source) return;
        tried_[tried_count_++] = source;
        const float now = cost(source, least_ / factor) * factor;
        if (now >= least_) return;
        least_ = now;
        best_ = source;
    }

    /// At least `limit` where it is not less than that.
    float cost(cv::Point source, float limit) const {
        const std::uint8_t* rgb = r_.source_bytes.at(source);
        float apart = r_.balance.cost()(source);
        for (int c = 0; c < 3; ++c) {
            const auto value = static_cast<float>(rgb[c]);
            const float off = value - vote_[static_cast<std::size_t>(c)];
            apart += vote_weight_ * off * off + pull_[c] * value;
        }
        for (const cv::Point& continued : continued_) apart += source == continued ? 0 : r_.cut;
        if (apart >= limit) return apart;
        const float left = std::min(limit - apart, 1e9F);
        return apart + static_cast<float>(difference(source, static_cast<std::int32_t>(left) + 1));
    }

    /// Sum of squared byte differences of the patches; may stop in the middle once it is at least `limit`.
    std::int32_t difference(cv::Point source, std::int32_t limit) const {
        const std::uint8_t* s = r_.source_bytes.at({source.x - half_, source.y - half_});
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

void refine_row(const Refinement& refinement, int y, int first, cv::Vec2i* refined) {
    RowRefiner refiner(refinement);
    for (int x = first; x < refinement.coordinates.cols; x += 2)
        if (refinement.target.valid(y, x)) refined[x] = refiner.pixel({x, y});
}

}  // namespace HWY_NAMESPACE
}  // namespace darkbox
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace darkbox {

HWY_EXPORT(refine_row);

void refine_row(const Refinement& refinement, int y, int first, cv::Vec2i* refined) {
    HWY_DYNAMIC_DISPATCH(refine_row)(refinement, y, first, refined);
}

}  // namespace darkbox
#endif
