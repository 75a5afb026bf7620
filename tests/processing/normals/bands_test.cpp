#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "processing/maps/photo_source.h"
#include "processing/normals/bands.h"
#include "processing/normals/photometric_stereo.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using testing::HasSubstr;

Lights spiral(int count) {
    Lights lights(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double slant = 0.9 * std::sqrt((i + 0.5) / count), turn = 2.4 * i;
        lights[static_cast<std::size_t>(i)].direction = {std::sin(slant) * std::cos(turn),
                                                         std::sin(slant) * std::sin(turn), std::cos(slant)};
    }
    return lights;
}

/// Noise with some clipped samples: every path of the solver has something to do.
std::vector<PhotoRows> noise(std::size_t count, cv::Size size, int type) {
    std::vector<PhotoRows> photos(count);
    cv::theRNG().state = 11;
    for (PhotoRows& photo : photos) {
        const double full = CV_MAT_DEPTH(type) == CV_8U ? 255 : 65535;
        photo.samples = cv::Mat(size, type);
        cv::randu(photo.samples, cv::Scalar::all(0), cv::Scalar::all(1.01 * full));
        photo.black = 3;
        photo.scale = static_cast<float>(1 / full);
        photo.limit = static_cast<float>(full);
    }
    return photos;
}

cv::Mat1b disc(cv::Size size) {
    cv::Mat1b mask(size, uchar{0});
    for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x)
            mask(y, x) = std::hypot(x - size.width / 2, y - size.height / 2) < size.height / 2.1 ? 255 : 0;
    return mask;
}

PhotometricStereoResult solved(const std::vector<PhotoRows>& photos, const cv::Mat1b& mask, int band_rows,
                               int threads) {
    PhotosInMemory source(photos, {}, mask);
    PhotometricStereoOptions options;
    options.band_rows = band_rows;
    WorkContext work;
    work.threads = threads;
    return photometric_stereo(source, spiral(static_cast<int>(photos.size())), options, work);
}

bool same(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && a.type() == b.type() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

void expect_same(const PhotometricStereoResult& a, const PhotometricStereoResult& b) {
    EXPECT_TRUE(same(a.normals.normal, b.normals.normal));
    EXPECT_TRUE(same(a.normals.valid, b.normals.valid));
    EXPECT_TRUE(same(a.albedo.albedo, b.albedo.albedo));
    EXPECT_TRUE(same(a.residual, b.residual));
    EXPECT_TRUE(same(a.lights_used, b.lights_used));
    EXPECT_EQ(a.residual_rms, b.residual_rms);
    EXPECT_EQ(a.pixels, b.pixels);
}

TEST(Bands, SameBitsForAnyHeightOfBandsAndAnyNumberOfThreads) {
    const cv::Size size(301, 67);
    const auto photos = noise(9, size, CV_16UC3);
    const auto expected = solved(photos, disc(size), 67, 1);
    EXPECT_GT(expected.pixels, 2000U);
    for (const int rows : {1, 2, 13, 66, 1000})
        for (const int threads : {1, 2, 8}) expect_same(solved(photos, disc(size), rows, threads), expected);
}

TEST(Bands, NarrowSamplesGiveTheBitsOfTheirRadiance) {
    const cv::Size size(150, 20);
    for (const int type : {CV_8UC3, CV_16UC3}) {
        const auto photos = noise(6, size, type);
        PhotoStack stack;
        stack.mask = disc(size);
        for (const PhotoRows& photo : photos) {
            stack.images.push_back(radiance_of(photo));
            stack.clipped.push_back(clipped_of(photo));
            stack.files.emplace_back("a");
        }
        expect_same(solved(photos, stack.mask, 7, 2), photometric_stereo(stack, spiral(6)));
    }
}

TEST(Bands, CurveAndDarkRowsMakeTheRadianceThatTheSolverSees) {
    const cv::Size size(150, 20);
    auto photos = noise(6, size, CV_8UC3);
    auto curve = std::make_shared<std::vector<float>>(256);
    for (std::size_t i = 0; i < 256; ++i) (*curve)[i] = static_cast<float>(i * i) / 65025.0F;
    photos[0].curve = photos[3].curve = curve;
    photos[1].dark = cv::Mat3f(size, cv::Vec3f(1.5F, 2.5F, 3.5F));
    EXPECT_NEAR(radiance_of(photos[1])(4, 4)[2],
                (static_cast<float>(photos[1].samples.at<cv::Vec3b>(4, 4)[2]) - 3.5F) / 255, 1e-6);
    PhotoStack stack;
    stack.mask = cv::Mat1b(size, uchar{255});
    for (const PhotoRows& photo : photos) {
        stack.images.push_back(radiance_of(photo));
        stack.clipped.push_back(clipped_of(photo));
        stack.files.emplace_back("a");
    }
    expect_same(solved(photos, stack.mask, 3, 2), photometric_stereo(stack, spiral(6)));
}

TEST(Bands, PicturesOfOnePixelAndAThousandLightsAreSolved) {
    const auto result = solved(noise(1000, {1, 1}, CV_16UC3), cv::Mat1b(1, 1, uchar{255}), 0, 2);
    EXPECT_EQ(result.pixels, 1U);
    EXPECT_GT(result.lights_used(0, 0), 900);
}

TEST(Bands, BlackPhotographsHaveNoValidPixel) {
    auto photos = noise(5, {140, 3}, CV_8UC3);
    for (PhotoRows& photo : photos) {
        photo.samples.setTo(cv::Scalar::all(0));
        photo.black = 0;
    }
    const auto result = solved(photos, cv::Mat1b(3, 140, uchar{255}), 0, 2);
    EXPECT_EQ(result.pixels, 0U);
    EXPECT_EQ(result.residual_rms, 0.0);
}

TEST(Bands, AWhollyClippedPhotographIsLeftOut) {
    auto photos = noise(8, {140, 3}, CV_8UC3);
    for (PhotoRows& photo : photos) photo.samples.setTo(cv::Scalar::all(100));
    photos[2].samples.setTo(cv::Scalar::all(255));
    const auto result = solved(photos, cv::Mat1b(3, 140, uchar{255}), 0, 2);
    EXPECT_EQ(result.pixels, 420U);
    EXPECT_EQ(result.lights_used(1, 139), 7);
}

/// A source that only has a size.
class SizeOnly : public PhotoSource {
public:
    cv::Size size() const override { return {5472, 3648}; }
    std::size_t count() const override { return 64; }
    std::size_t bytes_per_row() const override { return 5472UL * 6 * 64; }
    std::size_t bytes_held() const override { return 0; }
    void read_next(int, PhotoBand&) override { throw std::logic_error("nothing to read"); }
    void rewind() override {}
    cv::Mat1b mask() const override { return {}; }
};

TEST(Bands, TwoBandsAndTheMapsFitTheMemory) {
    PhotometricStereoOptions options;
    options.memory_mib = 740;
    const int few = rows_of_a_band(SizeOnly(), options);
    options.memory_mib = 4096;
    EXPECT_GE(few, 1);
    EXPECT_LE(few, 16);
    EXPECT_EQ(rows_of_a_band(SizeOnly(), options), 16);
}

TEST(Bands, TooLittleMemoryIsAnErrorThatSaysHowMuchIsNeeded) {
    PhotometricStereoOptions options;
    options.memory_mib = 500;
    EXPECT_THAT(test::input_error_of([&] { rows_of_a_band(SizeOnly(), options); }), HasSubstr("memory_mib is 500"));
}

TEST(Bands, OptionsNameWhatIsWrong) {
    PhotometricStereoOptions options;
    options.memory_mib = 0;
    EXPECT_THAT(test::input_error_of([&] { options.validate(); }), HasSubstr("memory_mib"));
    options.memory_mib = 100;
    options.band_rows = -1;
    EXPECT_THAT(test::input_error_of([&] { options.validate(); }), HasSubstr("band_rows"));
}

}  // namespace
}  // namespace darkbox
