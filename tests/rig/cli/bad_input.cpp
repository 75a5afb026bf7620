#include "tests/rig/cli/bad_input.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace darkbox::test {

namespace fs = std::filesystem;

cv::Mat1b matte_ball(const Direction& l) {
    cv::Mat1b image(side, side, uchar{0});
    for (int v = 0; v < side; ++v)
        for (int u = 0; u < side; ++u) {
            const double x = (u - 48) / 40.0;
            const double y = -(v - 48) / 40.0;
            if (x * x + y * y >= 1) continue;
            const double shade = x * l.x + y * l.y + std::sqrt(1 - x * x - y * y) * l.z;
            image(v, u) = static_cast<uchar>(std::lround(200 * std::max(shade, 0.0)));
        }
    return image;
}

cv::Mat1b mirror_ball(const Direction& l, int highlight_value) {
    cv::Mat1b image(side, side, uchar{40});
    const double norm = std::sqrt(l.x * l.x + l.y * l.y + (l.z + 1) * (l.z + 1));
    const double hu = 48 + 40 * l.x / norm;
    const double hv = 48 - 40 * l.y / norm;
    for (int v = 0; v < side; ++v)
        for (int u = 0; u < side; ++u) {
            if (std::hypot(u - 48, v - 48) < 40) image(v, u) = 5;
            if (std::hypot(u - hu, v - hv) < 3) image(v, u) = static_cast<uchar>(highlight_value);
        }
    return image;
}

std::string BadInput::photographs(const std::string& name, const std::vector<Direction>& lights) {
    fs::create_directories(path(name));
    for (std::size_t i = 0; i < lights.size(); ++i)
        cv::imwrite((path(name) / fmt::format("p{}.png", i)).string(), matte_ball(lights[i]));
    return path(name).string();
}

std::string BadInput::lights_file(const std::vector<Direction>& lights) {
    std::ofstream file(path("lights.txt"));
    file << lights.size() << "\n";
    for (const Direction& l : lights) file << l.x << " " << l.y << " " << l.z << "\n";
    return path("lights.txt").string();
}

ProgramResult BadInput::import(const std::string& photos, const std::vector<Direction>& lights) {
    return darkbox_program(
        {"import", photos, "--lights", lights_file(lights), "--transfer", "linear", "--out", path("s").string()});
}

std::string BadInput::session() {
    const auto r = darkbox_program({"import", photographs("good", good_lights), "--lights", lights_file(good_lights),
                                    "--transfer", "linear", "--out", path("session").string()});
    EXPECT_EQ(r.status, 0) << r.err;
    return path("session").string();
}

void BadInput::expect_one_error(const ProgramResult& r, const std::string& names, int status) {
    EXPECT_EQ(r.status, status) << r.err;
    EXPECT_THAT(r.err, testing::HasSubstr("error: "));
    EXPECT_EQ(r.err.find("error: "), r.err.rfind("error: ")) << r.err;
    EXPECT_THAT(r.err, testing::HasSubstr(names));
    EXPECT_EQ(r.out, "");
}

}  // namespace darkbox::test
