#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <string>

#include "acquisition/session/session_writer.h"
#include "processing/formats/atomic_file.h"
#include "processing/formats/png.h"
#include "processing/normals/integrate.h"
#include "processing/normals/integration_memory.h"
#include "processing/pipeline/evaluate.h"
#include "processing/pipeline/import.h"
#include "processing/pipeline/photographs_seen.h"
#include "processing/pipeline/radiance.h"
#include "processing/pipeline/session_ball.h"
#include "processing/pipeline/session_files.h"
#include "processing/pipeline/stack.h"
#include "processing/pipeline/stages.h"
#include "tests/processing/pipeline/synthetic_photographs.h"
#include "tests/support/peak_memory.h"
#include "tests/support/test_data.h"
#include "tests/support/textured_sphere.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

using testing::AllOf;
using testing::HasSubstr;

bool same_bits(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type()) return false;
    for (int row = 0; row < a.rows; ++row)
        if (std::memcmp(a.ptr(row), b.ptr(row), static_cast<std::size_t>(a.cols) * a.elemSize()) != 0) return false;
    return true;
}

Session imported(const fs::path& photographs, const fs::path& out) {
    ImportOptions options;
    options.folders = {photographs};
    options.transfer = ImportTransfer::linear;
    options.out = out;
    return import_photographs(options);
}

/// Seven photographs of 96x80 pixels: two bands, the second of them shorter.
class FewPhotographs : public testing::Test {
protected:
    test::TemporaryFolder folder;
    Session session = [this] {
        fs::create_directories(folder.path() / "photos");
        test::write_photographs(folder.path() / "photos", test::lamp_ring());
        return imported(folder.path() / "photos", folder.path() / "s");
    }();
    PhotoStack stack = load_stack(session);
};

TEST_F(FewPhotographs, OfABallAreSeenAsIfAllWereInMemory) {
    BallFramesInMemory whole(stack.images);
    SessionBall ball(session, {});
    ASSERT_EQ(ball.count(), 7U);
    EXPECT_EQ(ball.files(), stack.files);
    for (const int side : {0, 50, 1024}) {
        const BallOverview expected = whole.overview(side), seen = ball.overview(side);
        EXPECT_TRUE(same_bits(seen.mean, expected.mean));
        ASSERT_EQ(seen.reduced.images.size(), side > 0 ? 7U : 0U);
        if (side == 0) continue;
        EXPECT_EQ(seen.reduced.scale, expected.reduced.scale);
        for (std::size_t i = 0; i < seen.reduced.images.size(); ++i)
            EXPECT_TRUE(same_bits(seen.reduced.images[i], expected.reduced.images[i]));
    }
    const std::vector<cv::Rect> boxes{{10, 50, 40, 25}, {0, 0, 96, 80}, {95, 79, 1, 1}};
    const auto expected = whole.parts(boxes), seen = ball.parts(boxes);
    for (std::size_t box = 0; box < boxes.size(); ++box)
        for (std::size_t i = 0; i < 7; ++i) EXPECT_TRUE(same_bits(seen[box][i], expected[box][i]));
    cv::Mat3f brightest = stack.images.front().clone();
    for (const cv::Mat3f& image : stack.images) brightest = cv::max(brightest, image);
    EXPECT_TRUE(same_bits(ball.brightest(), brightest));
    EXPECT_TRUE(same_bits(mask_of_brightest(ball.brightest_luminance(), {}), automatic_mask(stack.images, {})));
}

TEST_F(FewPhotographs, AreReportedAsIfAllWereInMemory) {
    const PhotographsSeen seen = see_photographs(session, 16, {});
    cv::Mat3f mean(stack.size(), cv::Vec3f(0, 0, 0));
    for (const cv::Mat3f& image : stack.images) mean += image;
    mean /= 7.0;
    EXPECT_EQ(seen.photographs, 7U);
    EXPECT_TRUE(same_bits(seen.mean, mean));
    EXPECT_TRUE(same_bits(seen.mask, stack.mask));
    std::vector<double> counts(16);
    for (const cv::Mat3f& image : stack.images)
        for (int y = 0; y < image.rows; ++y)
            for (int x = 0; x < image.cols; ++x)
                if (stack.mask(y, x) != 0) {
                    const cv::Vec3f& p = image(y, x);
                    ++counts[static_cast<std::size_t>(std::min(15.0F, 16 * std::max({p[0], p[1], p[2]})))];
                }
    const double all = 7.0 * cv::countNonZero(stack.mask);
    for (std::size_t bin = 0; bin < 16; ++bin) EXPECT_DOUBLE_EQ(seen.exposure[bin], counts[bin] / all);
}

TEST_F(FewPhotographs, OneAfterTheOtherAreTheSame) {
    std::vector<std::size_t> order;
    for_radiances(session, photographs_of(session, FrameKind::lit), {}, [&](std::size_t i, const Radiance& one) {
        order.push_back(i);
        EXPECT_TRUE(same_bits(one.image, stack.images[i]));
        EXPECT_TRUE(same_bits(one.clipped, stack.clipped[i]));
    });
    EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6}));
}

Frame grey_field(std::uint16_t level, std::int64_t taken_ns) {
    Frame frame;
    frame.width = 8;
    frame.height = 6;
    frame.format = PixelFormat::grey16;
    frame.bit_depth = 12;
    frame.timestamp = TimePoint(std::chrono::nanoseconds(taken_ns));
    frame.controls.exposure = Seconds(0.01);
    frame.pixels.resize(8 * 6 * 2);
    for (std::size_t i = 0; i < 48; ++i) std::memcpy(frame.pixels.data() + 2 * i, &level, 2);
    return frame;
}

/// Each lit frame stands between two ambient ones, and no other two say anything of it.
TEST(SomePhotographs, OnlyNeedTheAmbientFramesAroundThem) {
    test::TemporaryFolder folder;
    SessionWriter writer = SessionWriter::create(folder.path() / "s", SessionInfo{});
    for (int i = 0; i < 9; ++i) {
        FrameRecord record;
        record.kind = i % 2 == 0 ? FrameKind::ambient : FrameKind::lit;
        record.bit_depth = 12;
        record.timestamp_ns = 1000 * (i + 1) + 70 * i * i;
        if (i % 2 == 1) record.lamp = LampId{static_cast<std::uint32_t>(i / 2)};
        const int level = i % 2 == 0 ? 50 + 7 * i * i : 2000 + i;
        writer.add(grey_field(static_cast<std::uint16_t>(level), record.timestamp_ns), record);
    }
    const Session session = writer.seal();
    const std::vector<FrameRecord> lit = photographs_of(session, FrameKind::lit);
    ASSERT_EQ(lit.size(), 4U);
    const std::vector<Radiance> all = read_radiances(session, lit, {});
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_TRUE(same_bits(read_radiances(session, {lit[i]}, {}).front().image, all[i].image));
    const FrameBands one(session, {lit[1]}), every(session, lit);
    const std::size_t pixel = one.bytes_per_row() / 8, sample = 3 * sizeof(std::uint16_t);
    EXPECT_EQ(pixel, sample + 3 * sizeof(cv::Vec3f)) << "two ambient frames, and the light between them";
    EXPECT_EQ(every.bytes_per_row() / 8, 4 * sample + 6 * sizeof(cv::Vec3f));
}

/// Photographs of 2.4 megapixels that compress well.
Session many_photographs(const fs::path& folder, int count) {
    cv::Mat3b picture(1200, 2000, cv::Vec3b(3, 3, 3));
    for (int y = 300; y < 900; ++y)
        for (int x = 600; x < 1400; ++x) picture(y, x) = {200, static_cast<uchar>(100 + y / 10), 90};
    fs::create_directories(folder / "photos");
    write_png(folder / "photos" / "p00.png", picture);
    for (int i = 1; i < count; ++i)
        fs::copy_file(folder / "photos" / "p00.png", folder / "photos" / fmt::format("p{:02}.png", i));
    return imported(folder / "photos", folder / "s");
}

/// The mean, the brightest, the mask and two bands: what four photographs take as radiance, however many there are.
TEST(ManyPhotographs, ReportingThemTakesNoMoreMemoryThanFew) {
    test::TemporaryFolder folder;
    const Session session = many_photographs(folder.path(), 24);  // 715 MiB as radiance
    const test::PeakMemory peak;
    const PhotographsSeen seen = see_photographs(session, 64, {});
    const auto mib = peak.mib();
    if (!mib) GTEST_SKIP() << "the peak of memory is not to be had here";
    EXPECT_EQ(seen.photographs, 24U);
    EXPECT_LT(*mib, 180);
}

TEST(ManyPhotographs, ReadingABallTakesItsPartsAndNotTheFrames) {
    test::TemporaryFolder folder;
    const Session session = many_photographs(folder.path(), 24);
    SessionBall ball(session, {});
    const test::PeakMemory peak;
    const BallOverview overview = ball.overview(0);
    const auto parts = ball.parts({cv::Rect(100, 100, 200, 200)});
    const auto mib = peak.mib();
    if (!mib) GTEST_SKIP() << "the peak of memory is not to be had here";
    EXPECT_EQ(parts.front().size(), 24U);
    EXPECT_LT(*mib, 180);
}

/// With lights that came along, and an object that fills the picture.
TEST(TooLittleMemory, ForHeightOrEvaluationIsSaidBeforeTheyBegin) {
    test::TemporaryFolder folder;
    const fs::path photographs = folder.path() / "photos";
    fs::create_directories(photographs);
    const Lights lights = test::lamp_ring();
    test::write_photographs(photographs, lights);
    write_png(folder.path() / "white.png", cv::Mat1b(80, 96, uchar{255}));
    std::string directions;
    for (const Light& light : lights)
        directions += fmt::format("{} {} {}\n", light.direction.x(), light.direction.y(), light.direction.z());
    write_file(folder.path() / "lights.txt", directions);
    ImportOptions import;
    import.folders = {photographs};
    import.mask = folder.path() / "white.png";
    import.lights = folder.path() / "lights.txt";
    import.transfer = ImportTransfer::linear;
    import.out = folder.path() / "s";
    const Session session = import_photographs(import);
    run_calibrate(session);
    NormalsOptions normals;
    normals.stereo.memory_mib = 1;
    EXPECT_THAT(test::input_error_of([&] { run_normals(session, normals); }),
                AllOf(HasSubstr("memory_mib is 1"), HasSubstr("96x80 pixels needs 2")));
    EXPECT_FALSE(fs::exists(ResultFiles(session.folder()).normals));
    normals.surface = false;
    run_normals(session, normals);
    EvaluateOptions evaluate;
    evaluate.memory_mib = 1;
    EXPECT_THAT(test::input_error_of([&] { evaluate_session(session, evaluate); }),
                HasSubstr("evaluating 7 photographs of 96x80 pixels needs 4"));
}

TEST(IntegrationBytes, AreNoFewerThanTheIntegrationTakes) {
    const NormalMap normals = test::textured_sphere(600, 1).normals;
    const test::PeakMemory peak;
    const HeightMap height = integrate_normals({normals, {}});
    const auto mib = peak.mib();
    if (!mib) GTEST_SKIP() << "the peak of memory is not to be had here";
    const cv::Rect box = cv::boundingRect(height.valid);
    const double given_back = 6.0 * static_cast<double>(height.valid.total());
    EXPECT_LT(*mib, (static_cast<double>(integration_bytes(box.size())) + given_back) / (1 << 20));
    EXPECT_GT(*mib, 0.5 * static_cast<double>(integration_bytes(box.size())) / (1 << 20)) << "the figure is too large";
}

TEST(ManyPhotographs, AreHeldToBeReducedOnlyAsFarAsHalfAGibibyteGoes) {
    EXPECT_EQ(pictures_at_once(1), std::size_t{512} << 20);
    EXPECT_EQ(pictures_at_once(4 * std::size_t{20'000'000}), 6U);
    EXPECT_EQ(pictures_at_once(std::size_t{1} << 40), 1U);
}

}  // namespace
}  // namespace darkbox
