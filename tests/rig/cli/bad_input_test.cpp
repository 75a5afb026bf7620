// Bad input to the program as people run it: one clear error that names the thing and the remedy, status 1.

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/rig/cli/bad_input.h"

namespace darkbox::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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
    const auto imported = import(photographs("photos", two), two);
    ASSERT_EQ(imported.status, 0) << imported.err;
    expect_one_error(darkbox_program({"process", path("s").string()}), "three lights");
}

TEST_F(BadInput, CoplanarLights) {
    const std::vector<Direction> flat{{-0.6, 0, 0.8}, {0, 0, 1}, {0.6, 0, 0.8}, {0.28, 0, 0.96}};
    const auto imported = import(photographs("photos", flat), flat);
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
    const auto left_out = darkbox_program({"calibrate", path("s").string(), "--strict"});
    EXPECT_EQ(left_out.status, 3);
    EXPECT_THAT(left_out.err, HasSubstr("p2.png has no usable highlight"));
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string(), "--drop", "p2.png", "--strict"}).status, 0);
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

TEST_F(BadInput, ACameraThatIsNotThere) {
    std::ofstream(path("rig.toml"))
        << "[rig]\nname = \"r\"\n[camera]\ndriver = \"v4l2\"\ndevice = \"usb-Absent\"\n"
           "[lamps]\ndriver = \"gpio\"\n[lamps.gpio]\nchip = \"c\"\n[[lamps.lamp]]\nname = \"a\"\nline = \"L1\"\n"
           "position_mm = [0, 0, 900]\n";
    EXPECT_EQ(darkbox_program({"rig", "check", "--rig", path("rig.toml").string()}).status, 0);
    expect_one_error(darkbox_program({"rig", "check", "--camera", "--rig", path("rig.toml").string()}),
                     "/dev/v4l/by-id/usb-Absent");
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
                     "--light '1,2'", 2);
    expect_one_error(darkbox_program({"relight", s, "--out", path("x.png").string()}), "--light", 2);
    expect_one_error(
        darkbox_program({"relight", s, "--sequence", "turn", "--light", "0,0,1", "--out", path("x").string()}),
        "--environment", 2);
    expect_one_error(darkbox_program({"relight", s, "--light", "0,0,1", "--out", path("x.mp4").string()}), "ffmpeg");
    EXPECT_FALSE(fs::exists(path("x.png")));
}

TEST_F(BadInput, MapsChangedByHandAreRefused) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"process", s}).status, 0);
    cv::imwrite(s + "/texels/index.png", cv::Mat1w(2, 3, std::uint16_t{1}));
    expect_one_error(darkbox_program({"relight", s, "--light", "0,0,1", "--out", path("x.png").string()}), "2");
}

TEST_F(BadInput, EvaluateNeedsLightsAndATruthToCompareWith) {
    const std::string s = session();
    expect_one_error(darkbox_program({"evaluate", s}), "darkbox calibrate");
    ASSERT_EQ(darkbox_program({"calibrate", s}).status, 0);
    expect_one_error(darkbox_program({"evaluate", s, "--compare-solvers", "lsq", "lsq"}), "no true normals");
    expect_one_error(darkbox_program({"evaluate", s, "--drop", "p9.png"}), "p9.png");
    expect_one_error(darkbox_program({"evaluate", s, "--lights", path("none.lp").string()}), "none.lp");
    EXPECT_EQ(darkbox_program({"evaluate", s, "--solver", "magic"}).status, 2);
}

TEST_F(BadInput, EvaluateTellsOfEveryPhotograph) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"calibrate", s}).status, 0);
    const auto r = darkbox_program({"evaluate", s, "--ideal-sphere", "--compare-solvers", "lsq", "lsq", "--json"});
    ASSERT_EQ(r.status, 0) << r.err;
    const auto json = nlohmann::json::parse(r.out);
    ASSERT_EQ(json["held_out"].size(), good_lights.size());
    for (const auto& light : json["held_out"]) {
        EXPECT_THAT(light["file"].get<std::string>(), testing::StartsWith("p"));
        for (const char* predictor : {"darkbox_thesis", "darkbox_detail", "lambert"})
            EXPECT_GT(light["rmse_relative"].at(predictor).get<double>(), 0.0) << predictor;
    }
    EXPECT_LT(json["mean_angular_error_deg"], 5.0);
    EXPECT_FALSE(json["comparison"]["second_is_better"].get<bool>());
}

TEST_F(BadInput, StrictTurnsWarningsIntoStatusThree) {
    const std::vector<Direction> near_plane{{-0.6, 0.01, 0.8}, {0, 0.03, 1}, {0.6, -0.02, 0.8}, {0.28, 0.02, 0.96}};
    ASSERT_EQ(import(photographs("photos", near_plane), near_plane).status, 0);
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string()}).status, 0);
    EXPECT_EQ(darkbox_program({"calibrate", path("s").string(), "--strict"}).status, 3);
}

}  // namespace
}  // namespace darkbox::test
