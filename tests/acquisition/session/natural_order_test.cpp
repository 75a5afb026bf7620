#include "acquisition/session/natural_order.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

namespace darkbox {
namespace {

TEST(NaturalOrder, CountsAsPeopleDo) {
    const std::vector<std::string> ordered{"",          "1",         "2",          "10",          "cat",
                                           "cat.0.png", "cat.2.png", "cat.10.png", "cat.10b.png", "dog"};
    std::vector<std::string> shuffled{ordered.rbegin(), ordered.rend()};
    std::sort(shuffled.begin(), shuffled.end(), natural_less);
    EXPECT_EQ(shuffled, ordered);
}

TEST(NaturalOrder, NumbersOfAnyLengthCompareByValue) {
    EXPECT_TRUE(natural_less("99999999999999999999998", "99999999999999999999999"));
    EXPECT_TRUE(natural_less("a9", "a99999999999999999999999"));
    EXPECT_FALSE(natural_less("a10", "a9"));
}

TEST(NaturalOrder, IsATotalOrder) {
    const std::vector<std::string> names{"a1", "a01", "a001", "a0", "a00", "a", "a1b", "a01b", "b", "\xC3\xA9", "a-1"};
    for (const auto& a : names)
        for (const auto& b : names) {
            EXPECT_EQ(natural_less(a, b) || natural_less(b, a), a != b) << a << " " << b;
            EXPECT_FALSE(natural_less(a, b) && natural_less(b, a)) << a << " " << b;
            for (const auto& c : names) {
                const bool chained = natural_less(a, b) && natural_less(b, c);
                EXPECT_TRUE(!chained || natural_less(a, c)) << a << " " << b << " " << c;
            }
        }
}

}  // namespace
}  // namespace darkbox
