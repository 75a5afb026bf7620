// Averages, brackets and a lit room on the digital twin, merged by processing and held against the twin's exact
// radiance.
#include <gmock/gmock.h>

#include <cmath>

#include "processing/pipeline/merge_exposures.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "sim/renderer.h"
#include "tests/rig/capture/twin.h"

namespace darkbox {
namespace {

using test::Twin;

/// Radiance under one lamp as processing has it: 1 = full scale at the rig's exposure.
cv::Mat3f true_radiance(const sim::Scene& scene, LampId lamp, const RigDescription& rig) {
    const sim::RgbImage image = sim::render_radiance(scene, lamp);
    const sim::Sensor sensor = sim::sensor_of(rig.sim);
    const double gauge =
        rig.camera.exposure.count() * rig.camera.gain / sensor.reference_exposure_s / sensor.full_scale_radiance;
    cv::Mat3f radiance(image.height, image.width);
    for (int i = 0; i < image.height * image.width * 3; ++i)
        radiance.ptr<float>()[i] = static_cast<float>(gauge * image.samples[static_cast<std::size_t>(i)]);
    return radiance;
}

struct Errors {
    double mean = 0;      ///< of error over its predicted standard deviation
    double variance = 0;  ///< likewise: 1 when the prediction is right
    std::size_t samples = 0;
};

/// `sigma2` tells the variance expected of a sample of this true radiance; where it is 0 the sample is left out.
/// `room`: radiance of a room, which is not in the truth.
template <typename Variance>
Errors errors_of(const Radiance& found, const cv::Mat3f& truth, Variance sigma2, const cv::Mat3f& room) {
    Errors errors;
    for (int y = 0; y < truth.rows; ++y)
        for (int x = 0; x < truth.cols; ++x) {
            if (found.clipped(y, x) != 0) continue;
            for (int c = 0; c < 3; ++c) {
                const double variance = sigma2(truth(y, x)[c], room(y, x)[c]);
                if (variance <= 0) continue;
                const double error = (found.image(y, x)[c] - truth(y, x)[c]) / std::sqrt(variance);
                errors.mean += error;
                errors.variance += error * error;
                ++errors.samples;
            }
        }
    errors.mean /= static_cast<double>(errors.samples);
    errors.variance /= static_cast<double>(errors.samples);
    return errors;
}

template <typename Variance>
Errors errors_of(const Radiance& found, const cv::Mat3f& truth, Variance sigma2) {
    const cv::Mat3f dark(truth.size(), cv::Vec3f::all(0));
    return errors_of(found, truth, [&](double radiance, double) { return sigma2(radiance); }, dark);
}

/// Variance of one frame, in squared radiance of an exposure `factor` times the rig's; read noise, shot noise,
/// rounding.
double frame_variance(const RigDescription& rig, double radiance, double factor) {
    const sim::Sensor sensor = sim::sensor_of(rig.sim);
    const double electrons = radiance * factor * sensor.full_well_e;
    const double per_sample = sensor.full_well_e / (sensor.full_scale() - sensor.black_level);
    const double e2 = electrons + sensor.read_noise_e * sensor.read_noise_e + per_sample * per_sample / 12;
    const double scale = sensor.full_well_e * factor;
    return e2 / (scale * scale);
}

double read_variance(const RigDescription& rig, double factor) { return frame_variance(rig, 0, factor); }

std::vector<Radiance> photographs(const Session& session) {
    return read_radiances(session, photographs_of(session, FrameKind::lit), {});
}

TEST(Averages, AreOnePhotographALampOfAsMuchLessNoise) {
    for (const int averages : {1, 4, 9}) {
        Twin twin;
        twin.rig.capture.averages = averages;
        const Session session = twin.capture();
        session.verify();
        EXPECT_EQ(session.frames().size(), 2U + 6U * static_cast<unsigned>(averages));
        const std::vector<Radiance> found = photographs(session);
        ASSERT_EQ(found.size(), 6U);
        for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp) {
            const cv::Mat3f truth = true_radiance(twin.sim().scene(), LampId{lamp}, twin.rig);
            const Errors errors = errors_of(found[lamp], truth, [&](double radiance) {
                if (radiance > 0.9) return 0.0;
                return frame_variance(twin.rig, radiance, 1) / averages + read_variance(twin.rig, 1) / 2;
            });
            EXPECT_NEAR(errors.variance, 1.0, 0.04) << averages << " frames of lamp " << lamp;
            EXPECT_NEAR(errors.mean, 0.0, 0.06);
            EXPECT_GT(errors.samples, 50'000U);
        }
    }
}

TEST(Brackets, SeeIntoShadowsAndHighlightsAndAreAsNoisyAsPredicted) {
    Twin twin;
    twin.rig.capture.brackets = {1, 4, 0.25};
    const Session session = twin.capture();
    session.verify();
    ASSERT_EQ(session.frames().size(), 3U * 8U);
    const std::vector<Radiance> found = photographs(session);
    ASSERT_EQ(found.size(), 6U);
    for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp) {
        const cv::Mat3f truth = true_radiance(twin.sim().scene(), LampId{lamp}, twin.rig);
        const auto predicted = [&](double radiance) {
            double weights = 0;
            for (const double factor : twin.rig.capture.brackets) {
                if (radiance * factor > 0.9) continue;
                weights += 1 / (frame_variance(twin.rig, radiance, factor) + read_variance(twin.rig, factor) / 2);
            }
            return 1 / weights;
        };
        // Around where an exposure begins to saturate the prediction jumps; there, only the bias is looked at.
        const auto in = [&](double low, double high) {
            return [=](double radiance) { return radiance >= low && radiance < high ? predicted(radiance) : 0.0; };
        };
        const Errors dark = errors_of(found[lamp], truth, in(0.0, 0.2));
        EXPECT_NEAR(dark.variance, 1.0, 0.05) << "lamp " << lamp;
        EXPECT_NEAR(dark.mean, 0.0, 0.06);
        const Errors bright = errors_of(found[lamp], truth, in(0.26, 0.85));
        if (bright.samples > 500) {
            EXPECT_NEAR(bright.variance, 1.0, 0.2) << "lamp " << lamp;
            EXPECT_NEAR(bright.mean, 0.0, 0.15);
        }
        const Errors edge = errors_of(found[lamp], truth, in(0.2, 0.26));
        if (edge.samples > 200) {
            EXPECT_NEAR(edge.mean, 0.0, 0.3) << "no bias where exposures are left out";
        }
        EXPECT_LT(predicted(0.05), 0.3 * frame_variance(twin.rig, 0.05, 1)) << "and it is worth the while";
    }
}

/// What is beyond full scale at the rig's exposure is there all the same.
TEST(Brackets, ReachBeyondFullScale) {
    Twin twin;
    twin.rig.camera.exposure = Seconds(0.08);
    twin.rig.capture.brackets = {1, 0.125};
    const std::vector<Radiance> found = photographs(twin.capture());
    const cv::Mat3f truth = true_radiance(twin.sim().scene(), LampId{0}, twin.rig);
    std::size_t beyond = 0;
    for (int y = 0; y < truth.rows; ++y)
        for (int x = 0; x < truth.cols; ++x) {
            if (truth(y, x)[0] < 1.2 || truth(y, x)[0] > 6) continue;
            ++beyond;
            EXPECT_EQ(found[0].clipped(y, x), 0);
            EXPECT_NEAR(found[0].image(y, x)[0] / truth(y, x)[0], 1.0, 0.1);
        }
    EXPECT_GT(beyond, 1000U);
}

/// Exact truth: without noise the merged radiance is the true one, also where one exposure is clipped.
TEST(MergeExposures, IsExactWithoutNoise) {
    const auto exposure = [](double factor) {
        ExposureRows rows{.sum = cv::Mat3f(1, 8),
                          .unlit = cv::Mat3f(1, 8, cv::Vec3f::all(60)),
                          .clipped = cv::Mat3b(1, 8, cv::Vec3b::all(0)),
                          .frames = 2,
                          .unlit_frames = 2,
                          .full_scale = 4095,
                          .radiance = 1 / (4035 * factor),
                          .noise = {4, 0.2}};
        for (int x = 0; x < 8; ++x) {
            const double sample = std::min(4095.0, 60 + 4035 * factor * 0.2 * (x + 1));
            rows.sum(0, x) = cv::Vec3f::all(static_cast<float>(2 * sample));
            if (sample >= 4095) rows.clipped(0, x) = cv::Vec3b::all(255);
        }
        return rows;
    };
    const MergedRows merged = merge_exposures({exposure(1), exposure(4), exposure(0.25)});
    for (int x = 0; x < 8; ++x) {
        EXPECT_NEAR(merged.radiance(0, x)[1], 0.2 * (x + 1), 1e-5);
        EXPECT_EQ(merged.clipped(0, x), 0);
    }
    const MergedRows clipped = merge_exposures({exposure(1), exposure(4)});
    EXPECT_EQ(clipped.clipped(0, 3), 0);
    EXPECT_EQ(clipped.clipped(0, 5), 255) << "full scale in the shortest of them";
}

TEST(Ambient, ALitRoomIsTakenOff) {
    Twin twin;
    twin.rig.sim.room_light = 0.02;
    twin.rig.capture.ambient = true;
    twin.rig.capture.dark_every = 2;
    const Session session = twin.capture();
    session.verify();
    EXPECT_EQ(session.frames().front().kind, FrameKind::ambient);
    const std::vector<Radiance> found = photographs(session);
    cv::Mat3f room(found[0].image.size(), cv::Vec3f::all(0));
    for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp)
        room += twin.rig.sim.room_light * true_radiance(twin.sim().scene(), LampId{lamp}, twin.rig);
    for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp) {
        const cv::Mat3f truth = true_radiance(twin.sim().scene(), LampId{lamp}, twin.rig);
        const auto predicted = [&](double radiance, double lit_room) {
            constexpr double room_frames = 5.0 / 9;  // a third of the way from one of them to the next
            return radiance > 0.7 ? 0.0
                                  : frame_variance(twin.rig, radiance + lit_room, 1) +
                                        room_frames * frame_variance(twin.rig, lit_room, 1);
        };
        const Errors errors = errors_of(found[lamp], truth, predicted, room);
        EXPECT_NEAR(errors.mean, 0.0, 0.05) << "lamp " << lamp;
        EXPECT_NEAR(errors.variance, 1.0, 0.1) << "lamp " << lamp;
    }
}

/// A retaken frame has the ambient light of its own run taken off, not that of the old one.
TEST(Ambient, OfARetakeIsItsOwn) {
    Twin twin;
    twin.rig.sim.room_light = 0.01;
    twin.rig.capture.ambient = true;
    const Session old = twin.capture();
    Twin later;
    later.rig.sim.room_light = 0.03;
    later.rig.capture.ambient = true;
    const Session session =
        later
            .capture(
                {.folder = later.folder.path() / "again", .object = "", .lamps = {"lamp-02"}, .retake = old.folder()})
            .session;
    const std::vector<Radiance> found = photographs(session);
    ASSERT_EQ(found.size(), 6U);
    for (std::uint32_t lamp = 0; lamp < found.size(); ++lamp) {
        const cv::Mat3f truth = true_radiance(twin.sim().scene(), LampId{lamp}, twin.rig);
        const Errors errors = errors_of(found[lamp], truth, [&](double radiance) {
            return radiance > 0.7 ? 0.0 : frame_variance(twin.rig, radiance, 1) + read_variance(twin.rig, 1);
        });
        EXPECT_NEAR(errors.mean, 0.0, 0.05) << "lamp " << lamp;
    }
}

/// In predictive mode the frame that could not be proven on the way is taken after the others.
TEST(FrameOrder, IsThePlansWhateverWasTakenWhen) {
    int repeated = 0;
    for (int lost = 4; lost < 20; lost += 3) {
        Twin twin("drop@" + std::to_string(lost));
        twin.rig.capture.mode = SyncMode::predictive;
        const Session session = twin.capture();
        session.verify();
        std::vector<std::string> files;
        for (const FrameRecord& record : session.frames()) files.push_back(record.file);
        EXPECT_TRUE(std::ranges::is_sorted(files)) << "frame " << lost << " lost";
        if (!std::ranges::is_sorted(session.frames(), {}, &FrameRecord::timestamp_ns)) ++repeated;
    }
    EXPECT_GT(repeated, 0) << "else this proves nothing";
}

}  // namespace
}  // namespace darkbox
