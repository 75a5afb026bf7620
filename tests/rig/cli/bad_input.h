#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox::test {

// Photographs to spoil, and what is asked of the program then: one clear error, never a crash.

inline constexpr int side = 96;

struct Direction {
    double x, y, z;
};

inline const std::vector<Direction> good_lights{
    {0.5, 0.3, 0.81}, {-0.5, 0.3, 0.81}, {0.0, -0.6, 0.8}, {0.1, 0.1, 0.99}};

/// A matte ball of radius 40 in the middle, 8 bits.
cv::Mat1b matte_ball(const Direction& l);

/// A mirror ball of radius 40 on a grey ground, with the lamp's highlight where reflection puts it.
cv::Mat1b mirror_ball(const Direction& l, int highlight_value);

class BadInput : public testing::Test {
protected:
    std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

    /// A folder of photographs p0.png... of the matte ball under these lights.
    std::string photographs(const std::string& name, const std::vector<Direction>& lights);

    std::string lights_file(const std::vector<Direction>& lights);

    /// Imports as linear photographs under these lights; the session is at path("s").
    ProgramResult import(const std::string& photos, const std::vector<Direction>& lights);

    /// A sealed session of a good capture with given lights.
    std::string session();

    /// Status 1 (2 for wrong usage), one "error: " that names this, nothing on stdout.
    static void expect_one_error(const ProgramResult& r, const std::string& names, int status = 1);

    TemporaryFolder folder_;
};

}  // namespace darkbox::test
