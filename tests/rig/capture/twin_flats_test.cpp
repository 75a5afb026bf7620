// Flat frames of a card on the digital twin, whose lamps give known shares of their light, and what processing makes
// of them.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <iostream>

#include "processing/formats/map_files.h"
#include "processing/pipeline/angular_error.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stages.h"
#include "sim/renderer.h"
#include "tests/rig/capture/twin.h"

namespace darkbox {
namespace {

using test::Twin;

constexpr const char* uneven = "dim-lamp@0:1=0.6 dim-lamp@0:4=0.8";
constexpr std::array<double, 6> share_of_lamp{1, 0.6, 1, 1, 0.8, 1};
constexpr double mean_share = 5.4 / 6;

struct UnevenTwin : Twin {
    explicit UnevenTwin(const std::string& scene, const std::string& faults = uneven) : Twin(faults) {
        std::string toml = rig.toml;
        const std::string built_in = "brick-torus";
        toml.replace(toml.find(built_in), built_in.size(), scene);
        rig = parse_rig(toml, "rig.toml");
    }
};

/// An object's session with the flat frames of a card.
Session session_with_flats(const test::TemporaryFolder& folder, Twin& card, Twin& object) {
    const std::filesystem::path flats = card.capture({.folder = folder.path() / "card",
                                                      .object = "",
                                                      .lamps = {},
                                                      .exposure = ExposureChoice{},
                                                      .kind = FrameKind::flat})
                                            .session.folder();
    return object.capture({.folder = folder.path() / "vase", .object = "vase", .lamps = {}, .flats = flats}).session;
}

/// Mean, in degrees, against the twin's own normals.
double error_of_normals(const Session& session, const sim::Scene& scene, IntensityChoice intensities) {
    NormalsOptions options;
    options.intensities = intensities;
    options.surface = false;
    (void)run_normals(session, options);
    const sim::SceneTruth truth = sim::render_truth(scene);
    NormalMap exact{cv::Mat3f(scene.view.height, scene.view.width), cv::Mat1b(scene.view.height, scene.view.width)};
    for (int y = 0; y < scene.view.height; ++y)
        for (int x = 0; x < scene.view.width; ++x) {
            const auto* n = truth.normals.pixel(x, y);
            exact.normal(y, x) = {n[0], n[1], n[2]};
            exact.valid(y, x) = truth.mask[static_cast<std::size_t>(y * scene.view.width + x)] ? 255 : 0;
        }
    return angular_error(read_normal_map(ResultFiles(session.folder()).normals), exact).mean_deg;
}

/// The largest relative error of a lamp's intensity in a channel.
double worst_intensity(const Lights& lights) {
    double worst = 0;
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
        for (int channel = 0; channel < 3; ++channel)
            worst = std::max(worst, std::abs(lights[lamp].intensity[channel] / (share_of_lamp[lamp] / mean_share) - 1));
    return worst;
}

/// With equal lamps, processed as such: what the solver makes of so few lamps when all is known.
double error_with_equal_lamps(const std::string& scene) {
    UnevenTwin object(scene, "");
    const Session session = object.capture();
    (void)run_calibrate(session);
    return error_of_normals(session, object.sim().scene(), IntensityChoice::given);
}

/// The ball has 58 pixels: it tells a distant lamp's direction to some 0.3 degrees, which at 55 degrees is 1 % of its
/// n.L on the card, and a near lamp's distance less well.
TEST(TwinFlats, TellHowBrightEachLampIs) {
    for (const auto& [light, within] : {std::pair<std::string, double>{"", 0.015}, {"-near", 0.03}}) {
        const test::TemporaryFolder folder;
        UnevenTwin card("card" + light), object("sphere" + light);
        const Session session = session_with_flats(folder, card, object);
        session.verify();
        EXPECT_NE(session.frames().front().exposure_s, session.frames().back().exposure_s) << "the card was metered";
        const Calibration found = run_calibrate(session).calibration;
        EXPECT_EQ(found.intensity_origin, IntensityOrigin::flat);
        const double worst = worst_intensity(found.lights);
        EXPECT_LT(worst, within) << light;
        const double equal = error_with_equal_lamps("sphere" + light);
        const double with_flats = error_of_normals(session, object.sim().scene(), IntensityChoice::given);
        EXPECT_NEAR(with_flats, equal, 0.3) << light;
        UnevenTwin blind("sphere" + light);
        const Session unknown = blind.capture();
        (void)run_calibrate(unknown);
        const double without = error_of_normals(unknown, blind.sim().scene(), IntensityChoice::given);
        EXPECT_GT(without, with_flats + 1.0) << light;
        std::cout << "sphere" << light << ": intensities within " << 100 * worst << " %, normals " << with_flats
                  << " degrees off with them, " << without << " without, " << equal << " with equal lamps\n";
    }
}

/// A session of a card alone has no lights to tell and says what it is for.
TEST(TwinFlats, AreNoObject) {
    UnevenTwin card("card");
    const Session session =
        card.capture({.folder = card.folder.path() / "card", .object = "", .lamps = {}, .kind = FrameKind::flat})
            .session;
    try {
        (void)run_calibrate(session);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("shows no object"));
        EXPECT_THAT(error.hint(), testing::HasSubstr("--flats-from"));
    }
}

}  // namespace
}  // namespace darkbox
