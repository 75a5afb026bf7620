// Photographs that hold nothing, too much, or something else.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "processing/formats/exr.h"
#include "tests/rig/cli/bad_input.h"

namespace darkbox::test {
namespace {

using testing::HasSubstr;

class BadPhotographs : public BadInput {
protected:
    /// The good photographs as linear EXR, one of them with this value in one pixel.
    ProgramResult import_exr_with(float spoilt) {
        std::filesystem::create_directories(path("exr"));
        for (std::size_t i = 0; i < good_lights.size(); ++i) {
            cv::Mat3b colour;
            cv::cvtColor(matte_ball(good_lights[i]), colour, cv::COLOR_GRAY2RGB);
            cv::Mat3f linear;
            colour.convertTo(linear, CV_32F, 1.0 / 255);
            if (i == 2) linear(50, 40)[1] = spoilt;
            write_exr(path("exr") / fmt::format("p{}.exr", i), linear);
        }
        return darkbox_program(
            {"import", path("exr").string(), "--lights", lights_file(good_lights), "--out", path("s").string()});
    }

    /// A session of the good photographs where `spoil` did something to p2.png.
    template <class Spoil>
    std::string session_with(Spoil spoil) {
        const std::string photos = photographs("photos", good_lights);
        cv::Mat1b image = matte_ball(good_lights[2]);
        spoil(image);
        cv::imwrite(path("photos/p2.png").string(), image);
        const auto r = import(photos, good_lights);
        EXPECT_EQ(r.status, 0) << r.err;
        return path("s").string();
    }

    /// A ball capture of four frames, which `spoil` may change by their number, beside good photographs.
    template <class Spoil>
    std::string ball_session(const std::string& ball, Spoil spoil) {
        std::filesystem::create_directories(path("ball"));
        for (std::size_t i = 0; i < good_lights.size(); ++i) {
            cv::Mat1b image = mirror_ball(good_lights[i], 250);
            spoil(image, i);
            cv::imwrite((path("ball") / fmt::format("b{}.png", i)).string(), image);
        }
        std::vector<std::string> arguments{"import",        photographs("photos", good_lights),
                                           "--ball-images", path("ball").string(),
                                           "--transfer",    "linear",
                                           "--out",         path("s").string()};
        if (!ball.empty()) arguments.insert(arguments.end(), {"--ball", ball});
        const auto r = darkbox_program(arguments);
        EXPECT_EQ(r.status, 0) << r.err;
        return path("s").string();
    }
};

TEST_F(BadPhotographs, FloatPicturesWork) {
    EXPECT_EQ(import_exr_with(0.5F).status, 0);
    EXPECT_EQ(darkbox_program({"process", path("s").string()}).status, 0);
}

TEST_F(BadPhotographs, NotANumberInAPicture) {
    const auto r = import_exr_with(std::nanf(""));
    expect_one_error(r, "p2.exr");
    EXPECT_THAT(r.err, HasSubstr("(40, 50)"));
}

TEST_F(BadPhotographs, InfinityInAPicture) {
    expect_one_error(import_exr_with(std::numeric_limits<float>::infinity()), "p2.exr");
    expect_one_error(import_exr_with(-std::numeric_limits<float>::infinity()), "p2.exr");
}

TEST_F(BadPhotographs, EnormousAndNegativeValuesDoNotBreakTheRest) {
    for (const float spoilt : {1e38F, -1e38F, -0.5F, 1e-42F}) {
        std::filesystem::remove_all(path("s"));
        ASSERT_EQ(import_exr_with(spoilt).status, 0) << spoilt;
        const auto r = darkbox_program({"process", path("s").string(), "--json"});
        ASSERT_EQ(r.status, 0) << spoilt << r.err;
        EXPECT_GT(nlohmann::json::parse(r.out)["normals"]["pixels"], 4000) << spoilt;
    }
}

TEST_F(BadPhotographs, AFrameThatIsBlackAllOver) {
    const std::string s = session_with([](cv::Mat1b& image) { image = 0; });
    const auto r = darkbox_program({"process", s, "--strict", "--json"});
    EXPECT_EQ(r.status, 3) << r.err;
    EXPECT_THAT(r.err, HasSubstr("p2.png is black wherever the object is, and was left out"));
    EXPECT_EQ(nlohmann::json::parse(r.out)["normals"]["images"], 3);
    ASSERT_EQ(darkbox_program({"calibrate", s, "--drop", "p2.png"}).status, 0);
    EXPECT_EQ(darkbox_program({"normals", s}).err, "");
    expect_one_error(darkbox_program({"calibrate", s, "--drop", "p7.png"}), "p7.png");
}

TEST_F(BadPhotographs, EveryFrameBlack) {
    std::filesystem::create_directories(path("photos"));
    for (int i = 0; i < 4; ++i)
        cv::imwrite((path("photos") / fmt::format("p{}.png", i)).string(), cv::Mat1b(side, side, uchar{0}));
    ASSERT_EQ(import(path("photos").string(), good_lights).status, 0);
    expect_one_error(darkbox_program({"process", path("s").string()}), "object");
}

TEST_F(BadPhotographs, AFrameThatIsClippedAllOver) {
    const std::string s = session_with([](cv::Mat1b& image) { image = 255; });
    const auto r = darkbox_program({"process", s});
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_THAT(r.err, HasSubstr("p2.png"));
    EXPECT_THAT(r.err, HasSubstr("clipped"));
}

TEST_F(BadPhotographs, EveryFrameClipped) {
    std::filesystem::create_directories(path("photos"));
    cv::imwrite(path("mask.png").string(), matte_ball(good_lights[3]) > 0);
    for (int i = 0; i < 4; ++i)
        cv::imwrite((path("photos") / fmt::format("p{}.png", i)).string(), cv::Mat1b(side, side, uchar{255}));
    ASSERT_EQ(darkbox_program({"import", path("photos").string(), "--lights", lights_file(good_lights), "--mask",
                               path("mask.png").string(), "--transfer", "linear", "--out", path("s").string()})
                  .status,
              0);
    for (const char* solver : {"lsq", "robust"})
        expect_one_error(darkbox_program({"process", path("s").string(), "--solver", solver}), "clipped");
}

TEST_F(BadPhotographs, TooFewFramesThatAreNotBlack) {
    const std::string photos = photographs("photos", good_lights);
    for (const char* black : {"photos/p1.png", "photos/p2.png"})
        cv::imwrite(path(black).string(), cv::Mat1b(side, side, uchar{0}));
    ASSERT_EQ(import(photos, good_lights).status, 0);
    expect_one_error(darkbox_program({"process", path("s").string()}), "black");
}

TEST_F(BadPhotographs, AFrameWhoseBallShowsNothingIsLeftOut) {
    for (const uchar value : {uchar{0}, uchar{255}}) {
        std::filesystem::remove_all(path("s"));
        const std::string s = ball_session("48,48,40", [value](cv::Mat1b& image, std::size_t i) {
            if (i == 1) image = value;
        });
        const auto r = darkbox_program({"calibrate", s, "--strict"});
        EXPECT_EQ(r.status, 3) << r.err;
        EXPECT_THAT(r.err, HasSubstr("p1.png has no usable highlight"));
    }
}

TEST_F(BadPhotographs, ABallThatShowsTooFewLamps) {
    const std::string s = ball_session("48,48,40", [](cv::Mat1b& image, std::size_t i) {
        if (i > 1) image = 0;
    });
    expect_one_error(darkbox_program({"calibrate", s}), "p2.png, p3.png");
}

TEST_F(BadPhotographs, ABallOutsideThePicture) {
    const std::string s = ball_session("", [](cv::Mat1b&, std::size_t) {});
    for (const char* ball : {"--ball=500,500,40", "--ball=-300,48,40", "--ball=48,48,4000"})
        expect_one_error(darkbox_program({"calibrate", s, ball}), "ball");
}

TEST_F(BadPhotographs, ABallOfNoSize) {
    const std::string s = ball_session("", [](cv::Mat1b&, std::size_t) {});
    for (const char* ball : {"--ball=48,48,0", "--ball=48,48,-3"})
        expect_one_error(darkbox_program({"calibrate", s, ball}), "ball");
    for (const char* ball : {"--ball=48,48,nan", "--ball=48,48"})
        expect_one_error(darkbox_program({"calibrate", s, ball}), "ball", 2);
}

TEST_F(BadPhotographs, OnePixel) {
    std::filesystem::create_directories(path("photos"));
    for (int i = 0; i < 4; ++i)
        cv::imwrite((path("photos") / fmt::format("p{}.png", i)).string(), cv::Mat1b(1, 1, uchar(100 + i)));
    cv::imwrite(path("mask.png").string(), cv::Mat1b(1, 1, uchar{255}));
    ASSERT_EQ(darkbox_program({"import", path("photos").string(), "--lights", lights_file(good_lights), "--mask",
                               path("mask.png").string(), "--transfer", "linear", "--out", path("s").string()})
                  .status,
              0);
    const auto r = darkbox_program({"process", path("s").string(), "--json"});
    EXPECT_EQ(r.status, 0) << r.err;
}

TEST_F(BadPhotographs, OnePixelOfABall) {
    std::filesystem::create_directories(path("photos"));
    for (int i = 0; i < 4; ++i)
        cv::imwrite((path("photos") / fmt::format("p{}.png", i)).string(), cv::Mat1b(1, 1, uchar(100 + i)));
    ASSERT_EQ(darkbox_program({"import", path("photos").string(), "--out", path("s").string()}).status, 0);
    expect_one_error(darkbox_program({"calibrate", path("s").string()}), "ball");
    expect_one_error(darkbox_program({"calibrate", path("s").string(), "--ball", "0,0,1"}), "ball");
}

TEST_F(BadPhotographs, AMaskOfAnotherSize) {
    cv::imwrite(path("mask.png").string(), cv::Mat1b(side, side + 1, uchar{255}));
    expect_one_error(darkbox_program({"import", photographs("photos", good_lights), "--mask", path("mask.png").string(),
                                      "--out", path("s").string()}),
                     "mask.png");
}

TEST_F(BadPhotographs, AMaskOnTheBackground) {
    cv::Mat1b mask(side, side, uchar{0});
    mask.row(2) = 255;
    cv::imwrite(path("mask.png").string(), mask);
    ASSERT_EQ(
        darkbox_program({"import", photographs("photos", good_lights), "--lights", lights_file(good_lights), "--mask",
                         path("mask.png").string(), "--transfer", "linear", "--out", path("s").string()})
            .status,
        0);
    expect_one_error(darkbox_program({"process", path("s").string()}), "mask");
    expect_one_error(darkbox_program({"evaluate", path("s").string()}), "mask");
}

TEST_F(BadPhotographs, OneFolderTwice) {
    const std::string photos = photographs("photos", good_lights);
    expect_one_error(darkbox_program({"import", photos, photos + "/.", "--out", path("s").string()}), "twice");
}

TEST_F(BadPhotographs, ThreeFoldersOfOneName) {
    std::vector<std::string> arguments{"import"};
    for (const char* day : {"monday", "tuesday", "wednesday"})
        arguments.push_back(photographs(std::string(day) + "/raw", {good_lights.front()}));
    arguments.insert(arguments.end(), {"--transfer", "linear", "--out", path("s").string()});
    const auto r = darkbox_program(arguments);
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_TRUE(std::filesystem::exists(path("s/data/frames/wednesday_raw_p0.png")));
}

}  // namespace
}  // namespace darkbox::test
