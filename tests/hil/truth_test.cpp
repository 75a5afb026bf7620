#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "tests/hil/machine.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// On the host, once the machine is off: what it captured is processed and compared with the twin's truth.
class Truth : public testing::Test {
protected:
    void SetUp() override {
        const char* folder = std::getenv("HIL_SESSIONS");
        if (folder == nullptr) GTEST_SKIP() << "compares what the virtual machine of ./run hil captured";
        sessions = folder;
    }

    /// `darkbox evaluate` of a captured session of the first so many lamps, which is told the truth only when all else
    /// is done.
    Json evaluation(const std::string& object, int lamps) const {
        const std::string session = (sessions / object).string();
        const std::string darkbox = test::program("darkbox");
        test::must(darkbox + " verify " + session);
        test::must(darkbox + " calibrate " + session);
        test::must(darkbox + " normals --solver robust " + session);
        fs::copy(std::getenv("HIL_TWIN") + std::string("/truth"), session + "/truth", fs::copy_options::recursive);
        const std::string lights = session + "/truth/lights.lp";
        test::must(fmt::format("sed -i -e '1s/.*/{}/' -e '{},$d' {}", lamps, lamps + 2, lights));
        const test::Printed printed =
            test::shell(darkbox + " evaluate --no-held-out --json " + session + " 2>/dev/null");
        EXPECT_EQ(printed.status, 0) << printed.text;
        return Json::parse(printed.text);
    }

    /// Sixteen lamps, whatever drove them.
    void expect_near_the_truth(const std::string& object) const;

    fs::path sessions;
};

/// Each machine captures some of them; a suite that captured none has failed already.
#define DARKBOX_NEED_SESSION(object) \
    if (!fs::exists(sessions / (object))) GTEST_SKIP() << "not captured in this machine"

void Truth::expect_near_the_truth(const std::string& object) const {
    const Json found = evaluation(object, 16);
    const double normals = found.at("normals").at("mean_deg"), lights = found.at("lights").at("max_deg");
    EXPECT_LE(normals, 1.5);
    EXPECT_LE(lights, 0.5);
    EXPECT_EQ(found.at("lights").at("count"), 16);
    EXPECT_GT(found.at("normals").at("count"), 25'000);
    std::cout << "  normals: mean " << normals << " degrees over " << found.at("normals").at("count")
              << " pixels; light directions: mean " << found.at("lights").at("mean_deg") << ", worst " << lights
              << '\n';
}

TEST_F(Truth, NormalsAndLightsOfTheWholeSession) {
    DARKBOX_NEED_SESSION("whole");
    expect_near_the_truth("whole");
}

TEST_F(Truth, NormalsAndLightsOfTheSessionOverUsb) {
    DARKBOX_NEED_SESSION("usb");
    expect_near_the_truth("usb");
}

TEST_F(Truth, FindsTheSwappedLampsOut) {
    DARKBOX_NEED_SESSION("swapped");
    const Json lights = evaluation("swapped", 6).at("lights").at("each");
    ASSERT_EQ(lights.size(), 6U);
    for (const Json& light : lights) {
        const std::string file = light.at("file");
        const bool swapped = file.find("lamp-03") != std::string::npos || file.find("lamp-06") != std::string::npos;
        const double error = light.at("error_deg");
        EXPECT_EQ(error > 0.5, swapped) << file << ": " << error << " degrees";
        if (swapped) std::cout << "  " << file << ": " << error << " degrees off\n";
    }
}

}  // namespace
}  // namespace darkbox
