// Bad input to the program as people run it: one clear error that names the thing and the remedy, status 1.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/rig/cli/program.h"
#include "tests/support/test_data.h"

namespace darkbox::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int side = 96;

struct Direction {
    double x, y, z;
};

const std::vector<Direction> good_lights{{0.5, 0.3, 0.81}, {-0.5, 0.3, 0.81}, {0.0, -0.6, 0.8}, {0.1, 0.1, 0.99}};

/// A matte ball of radius 40 in the middle, 8 bits.
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

/// A mirror ball of radius 40 on a grey ground, with the lamp's highlight where reflection puts it.
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

class BadInput : public testing::Test {
protected:
    fs::path path(const std::string& name) const { return folder_.path() / name; }

    /// A folder of photographs of the matte ball under these lights.
    std::string photographs(const std::string& name, const std::vector<Direction>& lights) {
        fs::create_directories(path(name));
        for (std::size_t i = 0; i < lights.size(); ++i)
            cv::imwrite((path(name) / fmt::format("p{}.png", i)).string(), matte_ball(lights[i]));
        return path(name).string();
    }

    std::string lights_file(const std::vector<Direction>& lights) {
        std::ofstream file(path("lights.txt"));
        file << lights.size() << "\n";
        for (const Direction& l : lights) file << l.x << " " << l.y << " " << l.z << "\n";
        return path("lights.txt").string();
    }

    /// A sealed session of a good capture with given lights.
    std::string session() {
        const auto r =
            darkbox_program({"import", photographs("good", good_lights), "--lights", lights_file(good_lights),
                             "--transfer", "linear", "--out", path("session").string()});
        EXPECT_EQ(r.status, 0) << r.err;
        return path("session").string();
    }

    static void expect_one_error(const ProgramResult& r, const std::string& names) {
        EXPECT_EQ(r.status, 1) << r.err;
        EXPECT_THAT(r.err, HasSubstr("error: "));
        EXPECT_EQ(r.err.find("error: "), r.err.rfind("error: ")) << r.err;
        EXPECT_THAT(r.err, HasSubstr(names));
        EXPECT_EQ(r.out, "");
    }

    TemporaryFolder folder_;
};

TEST_F(BadInput, GoodInputWorks) {
    const std::string s = session();
    const auto r = darkbox_program({"process", s, "--json"});
    ASSERT_EQ(r.status, 0) << r.err;
    EXPECT_TRUE(nlohmann::json::accept(r.out)) << r.out;
    EXPECT_TRUE(fs::exists(fs::path(s) / "report.html"));
}

TEST_F(BadInput, MissingFolder) {
    expect_one_error(darkbox_program({"import", path("nowhere").string(), "--out", path("s").string()}), "nowhere");
}

TEST_F(BadInput, MissingImageNamedByALightFile) {
    const std::string photos = photographs("photos", good_lights);
    std::ofstream(path("photos/rti.lp"))
        << "4\np0.png 0.5 0.3 0.81\np1.png -0.5 0.3 0.81\np2.png 0 -0.6 0.8\ngone.png 0.1 0.1 0.99\n";
    expect_one_error(darkbox_program({"import", photos, "--out", path("s").string()}), "gone.png");
}

TEST_F(BadInput, TruncatedImage) {
    const std::string photos = photographs("photos", good_lights);
    fs::resize_file(path("photos/p2.png"), fs::file_size(path("photos/p2.png")) / 2);
    expect_one_error(darkbox_program({"import", photos, "--out", path("s").string()}), "p2.png");
}

TEST_F(BadInput, ImagesOfDifferentSizes) {
    const std::string photos = photographs("photos", good_lights);
    cv::imwrite(path("photos/p3.png").string(), cv::Mat1b(side, side + 1, uchar{90}));
    expect_one_error(darkbox_program({"import", photos, "--out", path("s").string()}), "p3.png");
}

TEST_F(BadInput, TwoLightsOnly) {
    const std::vector<Direction> two(good_lights.begin(), good_lights.begin() + 2);
    const auto imported = darkbox_program({"import", photographs("photos", two), "--lights", lights_file(two),
                                           "--transfer", "linear", "--out", path("s").string()});
    ASSERT_EQ(imported.status, 0) << imported.err;
    expect_one_error(darkbox_program({"process", path("s").string()}), "three lights");
}

TEST_F(BadInput, CoplanarLights) {
    const std::vector<Direction> flat{{-0.6, 0, 0.8}, {0, 0, 1}, {0.6, 0, 0.8}, {0.28, 0, 0.96}};
    const auto imported = darkbox_program({"import", photographs("photos", flat), "--lights", lights_file(flat),
                                           "--transfer", "linear", "--out", path("s").string()});
    ASSERT_EQ(imported.status, 0) << imported.err;
    expect_one_error(darkbox_program({"process", path("s").string()}), "one plane");
}

TEST_F(BadInput, NoBall) {
    fs::create_directories(path("photos"));
    for (int i = 0; i < 4; ++i)
        cv::imwrite((path("photos") / fmt::format("p{}.png", i)).string(), cv::Mat1b(side, side, uchar(50 + i)));
    const auto imported =
        darkbox_program({"import", path("photos").string(), "--transfer", "linear", "--out", path("s").string()});
    ASSERT_EQ(imported.status, 0) << imported.err;
    expect_one_error(darkbox_program({"calibrate", path("s").string()}), "ball");
}

TEST_F(BadInput, BallWithoutAHighlightInOneFrame) {
    fs::create_directories(path("ball"));
    for (std::size_t i = 0; i < good_lights.size(); ++i)
        cv::imwrite((path("ball") / fmt::format("b{}.png", i)).string(), mirror_ball(good_lights[i], i == 2 ? 5 : 250));
    const auto imported =
        darkbox_program({"import", photographs("photos", good_lights), "--ball-images", path("ball").string(), "--ball",
                         "48,48,40", "--transfer", "linear", "--out", path("s").string()});
    ASSERT_EQ(imported.status, 0) << imported.err;
    expect_one_error(darkbox_program({"calibrate", path("s").string()}), "p2.png");
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string(), "--drop", "p2.png"}).status, 0);
}

TEST_F(BadInput, ChecksumThatDoesNotFit) {
    const fs::path s = session();
    fs::path frame;
    for (const auto& entry : fs::recursive_directory_iterator(s / "data" / "frames"))
        if (entry.is_regular_file()) frame = entry.path();
    fs::permissions(frame, fs::perms::owner_write, fs::perm_options::add);
    std::fstream file(frame, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(60);
    file.put('\x7f');
    file.close();
    for (const char* command : {"verify", "process", "calibrate"})
        expect_one_error(darkbox_program({command, s.string()}), frame.filename().string());
}

TEST_F(BadInput, UnknownKeyInTheRigDescription) {
    std::ofstream(path("rig.toml")) << "[rig]\nname = \"r\"\n[camera]\ndriver = \"sim\"\nexposure_mss = 20\n";
    expect_one_error(darkbox_program({"rig", "check", "--rig", path("rig.toml").string()}), "exposure_ms");
}

TEST_F(BadInput, OutputInsideASealedSession) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"process", s}).status, 0);
    const std::string frame = s + "/data/frames/p0.png";
    expect_one_error(darkbox_program({"relight", s, "--light", "0,0,1", "--out", frame}), "inside the session");
    EXPECT_EQ(darkbox_program({"verify", s}).status, 0);
}

TEST_F(BadInput, OldTexelsDoNotOutliveTheirNormals) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"process", s}).status, 0);
    ASSERT_EQ(darkbox_program({"normals", s}).status, 0);
    expect_one_error(darkbox_program({"relight", s, "--light", "0,0,1", "--out", path("x.png").string()}), "texels");
}

TEST_F(BadInput, JsonTellsOfAnErrorToo) {
    const auto r = darkbox_program({"verify", path("nothing").string(), "--json"});
    EXPECT_EQ(r.status, 1);
    EXPECT_THAT(nlohmann::json::parse(r.out).at("error").get<std::string>(), HasSubstr("nothing"));
}

TEST_F(BadInput, NotASession) { expect_one_error(darkbox_program({"process", path("nothing").string()}), "nothing"); }

TEST_F(BadInput, WrongUsageIsStatusTwo) {
    EXPECT_EQ(darkbox_program({"import"}).status, 2);
    EXPECT_EQ(darkbox_program({"no-such-command"}).status, 2);
    EXPECT_EQ(darkbox_program({}).status, 2);
}

TEST_F(BadInput, MalformedLightIsRefusedBeforeAnyWork) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"process", s}).status, 0);
    expect_one_error(darkbox_program({"relight", s, "--light", "1,2", "--out", path("x.png").string()}),
                     "--light '1,2'");
    expect_one_error(darkbox_program({"relight", s, "--out", path("x.png").string()}), "--light");
    EXPECT_FALSE(fs::exists(path("x.png")));
}

TEST_F(BadInput, StrictTurnsWarningsIntoStatusThree) {
    const std::vector<Direction> near_plane{{-0.6, 0.01, 0.8}, {0, 0.03, 1}, {0.6, -0.02, 0.8}, {0.28, 0.02, 0.96}};
    ASSERT_EQ(darkbox_program({"import", photographs("photos", near_plane), "--lights", lights_file(near_plane),
                               "--transfer", "linear", "--out", path("s").string()})
                  .status,
              0);
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string()}).status, 0);
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string(), "--strict"}).status, 3);
}

}  // namespace
}  // namespace darkbox::test
