#include "firmware/lampctl/budgets.h"

#include <gmock/gmock.h>

namespace darkbox::lampctl {
namespace {

LampSet only(std::uint8_t lamp) {
    LampSet set;
    set.add(lamp);
    return set;
}

/// Lights lamp 5 whenever `wish` says so and it may, for this long; the milliseconds that it was lit.
template <typename Wish>
unsigned lit_ms(Budgets& budgets, unsigned ms, Wish wish) {
    unsigned lit = 0;
    LampSet now;
    for (unsigned t = 0; t < ms; ++t) {
        LampSet next;
        if (wish(t) && (now.has(5) || budgets.may_light(5))) next = only(5);
        budgets.switched(now, next);
        now = next;
        if (now.has(5)) ++lit;
        if (budgets.tick(now) == 5) {
            budgets.switched(now, LampSet());
            now = LampSet();
        }
    }
    return lit;
}

TEST(Budgets, NoPatternExceedsTheShareByMoreThanOneStretch) {
    constexpr unsigned ms = 100'000, max_on = 200;
    for (const unsigned cooling : {1U, 16U, 64U, 255U}) {
        const double share = cooling / (64.0 + cooling);
        for (const unsigned period : {1U, 2U, 3U, 7U, 63U, 64U, 65U, 128U, 500U}) {
            Budgets budgets;
            budgets.limit(5, max_on, static_cast<std::uint8_t>(cooling));
            const unsigned lit = lit_ms(budgets, ms, [&](unsigned t) { return t % period < (period + 1) / 2; });
            EXPECT_LE(lit, max_on + share * ms) << "cooling " << cooling << ", period " << period;
        }
    }
}

TEST(Budgets, AnOrdinaryRhythmIsNotDisturbed) {
    Budgets budgets;
    budgets.limit(5, 1000, 64);
    EXPECT_EQ(lit_ms(budgets, 100'000, [](unsigned t) { return t % 1000 < 100; }), 10'000U);
}

TEST(Budgets, ManyShortFlashesAreNeverFree) {
    Budgets budgets;
    budgets.limit(5, 100, 64);
    int flashes = 0;
    for (; flashes < 1000 && budgets.may_light(5); ++flashes) {
        budgets.switched(LampSet(), only(5));
        budgets.switched(only(5), LampSet());
    }
    EXPECT_EQ(flashes, 100) << "each costs a millisecond at least";
}

}  // namespace
}  // namespace darkbox::lampctl
