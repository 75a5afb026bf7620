#include "rig/cli/progress_bar.h"

#include <gtest/gtest.h>

namespace darkbox {
namespace {

TEST(ProgressLine, ShowsHalfABarAndTheTimeLeft) {
    const std::string line = progress_line({"capture", 6, 12, "lamp-06"}, 3.0, 120);
    EXPECT_NE(line.find("[##############..............] 6/12"), std::string::npos) << line;
    EXPECT_NE(line.find("3 s left"), std::string::npos) << line;
    EXPECT_NE(line.find("lamp-06"), std::string::npos) << line;
}

TEST(ProgressLine, MoreDoneThanPlannedStaysAFullBar) {
    EXPECT_NE(progress_line({"x", 13, 12, ""}, 0, 120).find("[############################]"), std::string::npos);
}

TEST(ProgressLine, UnknownTotalShowsNoBar) {
    EXPECT_EQ(progress_line({"reading", 3, 0, "cat.png"}, 0, 120).find('['), std::string::npos);
}

TEST(ProgressLine, NeverReachesTheLastColumn) {
    EXPECT_LT(progress_line({"capture", 1, 2, std::string(300, 'x')}, 9, 80).size(), 80U);
}

}  // namespace
}  // namespace darkbox
