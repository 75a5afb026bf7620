// Light files that contradict themselves or the photographs.

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/rig/cli/bad_input.h"

namespace darkbox::test {
namespace {

using testing::HasSubstr;

class BadLights : public BadInput {
protected:
    /// The import of four good photographs p0.png...p3.png that lie beside this .lp file.
    ProgramResult import_with_lp(const std::string& lp) {
        const std::string photos = photographs("photos", good_lights);
        std::ofstream(path("photos/rti.lp")) << lp;
        return darkbox_program({"import", photos, "--transfer", "linear", "--out", path("s").string()});
    }

    void expect_refusal(const std::string& lp, const std::string& names) {
        const ProgramResult r = import_with_lp(lp);
        expect_one_error(r, names);
        EXPECT_THAT(r.err, HasSubstr("rti.lp"));
        EXPECT_FALSE(std::filesystem::exists(path("s")));
    }
};

TEST_F(BadLights, GoodFilesAreTaken) {
    const auto r = import_with_lp("4\np0.png .5 .3 .81\np1.png -.5 .3 .81\np2.png 0 -.6 .8\np3.png .1 .1 .99\n");
    EXPECT_EQ(r.status, 0) << r.err;
}

TEST_F(BadLights, ACountThatIsNotThatOfTheLines) {
    expect_refusal("5\np0.png .5 .3 .81\np1.png -.5 .3 .81\np2.png 0 -.6 .8\np3.png .1 .1 .99\n",
                   "it announces 5 lights, but 4 follow");
}

TEST_F(BadLights, TwoDirectionsForOnePhotograph) {
    expect_refusal("4\np0.png .5 .3 .81\np1.png -.5 .3 .81\np0.png 0 -.6 .8\np3.png .1 .1 .99\n", "p0.png");
}

TEST_F(BadLights, TwoDirectionsForOnePhotographInAFileGivenByHand) {
    const std::string photos = photographs("photos", good_lights);
    std::ofstream(path("other.lp"))
        << "5\np0.png .5 .3 .81\np1.png -.5 .3 .81\np0.png 0 -.6 .8\np2.png 0 0 1\np3.png .1 .1 .99\n";
    expect_one_error(darkbox_program({"import", photos, "--lights", path("other.lp").string(), "--transfer", "linear",
                                      "--out", path("s").string()}),
                     "p0.png");
}

TEST_F(BadLights, APhotographWithoutALight) {
    const std::string photos = photographs("photos", good_lights);
    std::ofstream(path("other.lp")) << "3\np0.png .5 .3 .81\np1.png -.5 .3 .81\np2.png 0 -.6 .8\n";
    expect_one_error(
        darkbox_program({"import", photos, "--lights", path("other.lp").string(), "--out", path("s").string()}),
        "p3.png");
}

TEST_F(BadLights, AMissingPhotograph) {
    expect_refusal("4\np0.png .5 .3 .81\np1.png -.5 .3 .81\np2.png 0 -.6 .8\ngone.png .1 .1 .99\n", "gone.png");
}

TEST_F(BadLights, AZeroVector) {
    expect_refusal("4\np0.png .5 .3 .81\np1.png 0 0 0\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
}

TEST_F(BadLights, NotANumber) {
    expect_refusal("4\np0.png .5 .3 .81\np1.png nan 0 1\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
    expect_refusal("4\np0.png .5 .3 .81\np1.png 0 inf 1\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
    expect_refusal("4\np0.png .5 .3 .81\np1.png east 0 1\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
}

TEST_F(BadLights, ANumberTooLargeForAnyComputer) {
    expect_refusal("4\np0.png .5 .3 .81\np1.png 1e999 0 1\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
    expect_refusal("4\np0.png .5 .3 .81\np1.png 1e200 1e200 1e200\np2.png 0 -.6 .8\np3.png .1 .1 .99\n", "line 3");
}

TEST_F(BadLights, ALightBehindTheObject) {
    const auto r = import_with_lp("4\np0.png .5 .3 .81\np1.png -.5 .3 .81\np2.png 0 -.6 -.8\np3.png .1 .1 .99\n");
    EXPECT_EQ(r.status, 0) << r.err;
    const auto calibrated = darkbox_program({"calibrate", path("s").string()});
    EXPECT_EQ(calibrated.status, 0) << calibrated.err;
    EXPECT_THAT(calibrated.err, HasSubstr("p2.png"));
}

TEST_F(BadLights, ThousandLightsGiveOneAnswer) {
    std::vector<Direction> lights;
    for (int i = 0; i < 1000; ++i) {
        const double turn = 0.61803 * 2 * 3.14159265 * i;
        const double away = 0.7 * std::sqrt((i + 0.5) / 1000);
        lights.push_back({away * std::cos(turn), away * std::sin(turn), std::sqrt(1 - away * away)});
    }
    ASSERT_EQ(import(photographs("photos", lights), lights).status, 0);
    const auto r = darkbox_program({"process", path("s").string(), "--json"});
    ASSERT_EQ(r.status, 0) << r.err;
    EXPECT_EQ(nlohmann::json::parse(r.out)["normals"]["images"], 1000);
    const auto lp = darkbox_program({"export", path("s").string(), "--format", "lp", "--out", path("lp").string()});
    EXPECT_EQ(lp.status, 0) << lp.err;
}

TEST_F(BadLights, OptionsThatWouldHaveNoEffectAreRefused) {
    const std::string s = session();
    expect_one_error(darkbox_program({"calibrate", s, "--photometric"}), "--photometric would have no effect");
    expect_one_error(darkbox_program({"calibrate", s, "--highlight", "nosuch.png=3,3"}), "--highlight");
    expect_one_error(darkbox_program({"calibrate", s, "--lamps", "near", "--method", "brightest"}),
                     "--lamps, --method");
    expect_one_error(darkbox_program({"calibrate", s, "--any-rig"}), "--any-rig");
    ASSERT_EQ(darkbox_program({"calibrate", s}).status, 0);
    expect_one_error(darkbox_program({"calibrate", s, "--from", s, "--ball", "3,3,4"}), "--ball");
}

TEST_F(BadLights, LightsOfOtherLamps) {
    const std::string s = session();
    ASSERT_EQ(darkbox_program({"calibrate", s}).status, 0);
    EXPECT_EQ(darkbox_program({"calibrate", s, "--from", s}).status, 0);
    const auto store = [&](const std::string& name, std::size_t lights) {
        auto json = nlohmann::json::parse(std::ifstream(std::filesystem::path(s) / "calibration/lights.json"));
        auto& all = json["lights"];
        while (all.size() < lights) all.push_back(all.front());
        for (std::size_t i = 0; i < all.size(); ++i) all[i]["lamp"] = fmt::format("other{}.png", i);
        std::ofstream(path(name)) << json;
        return path(name).string();
    };
    const std::string same_count = store("four.json", 4), more = store("six.json", 6);
    expect_one_error(darkbox_program({"calibrate", s, "--from", same_count}), "--any-rig");
    EXPECT_EQ(darkbox_program({"calibrate", s, "--from", same_count, "--any-rig"}).status, 0);
    expect_one_error(darkbox_program({"calibrate", s, "--from", more, "--any-rig"}), "6 lights for 4 frames");
}

TEST_F(BadLights, WrongUsageHasAStatusOfItsOwn) {
    const std::string s = session();
    for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
             {"calibrate", s, "--ball", "1,2"},
             {"export", s, "--format", "foo", "--out", path("x").string()},
             {"relight", s, "--out", path("x.png").string()},
             {"transfer", "--target", s, "--out", path("x").string()},
             {"transfer", "--source", s, "--source-normals", "n.exr", "--target", s, "--out", path("x").string()}})
        EXPECT_EQ(darkbox_program(wrong).status, 2) << wrong.front();
    const auto solver = darkbox_program({"normals", s, "--solver", "foo"});
    EXPECT_EQ(solver.status, 2);
    EXPECT_THAT(solver.err, HasSubstr("--solver: 'foo' is none of: lsq, robust"));
    expect_one_error(darkbox_program({"normals", s, "--memory-mib", "0"}), "--memory-mib is 0");
    expect_one_error(darkbox_program({"evaluate", s, "--no-held-out"}), "");
}

}  // namespace
}  // namespace darkbox::test
