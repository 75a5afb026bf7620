#include <gmock/gmock.h>

// GoogleTest exits 0 when every test was skipped; CTest is told 77 instead, so that a skip is seen.
int main(int argc, char** argv) {
    testing::InitGoogleMock(&argc, argv);
    const int status = RUN_ALL_TESTS();
    const auto& unit = *testing::UnitTest::GetInstance();
    const bool all_skipped = unit.test_to_run_count() > 0 && unit.skipped_test_count() == unit.test_to_run_count();
    return status == 0 && all_skipped ? 77 : status;
}
