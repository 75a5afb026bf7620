#include "processing/shading/shading.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>

#include "acquisition/frame/error.h"
#include "processing/shading/shading_bands.h"
#include "tests/support/textured_sphere.h"
#include "tests/support/throws.h"

namespace darkbox {
namespace {

using test::textured_sphere;
using test::TexturedSphere;

ShadingResult shade(const TexturedSphere& s, const ShadingOptions& options = {}, const WorkContext& work = {}) {
    return shading_maps(s.stack, s.lights, s.normals, s.albedo, s.index, options, work);
}

double largest_difference_to_lambert(const ShadingMaps& maps) {
    double largest = 0;
    for (int k = 0; k < maps.texels; ++k)
        for (int level = 0; level < maps.levels; ++level) {
            const double r = static_cast<double>(level) / (maps.levels - 1);
            for (int c = 0; c < 3; ++c)
                largest = std::max(largest, std::abs(maps.radiance(k, level)[c] - r * maps.mean_albedo(k, 0)[c]));
        }
    return largest;
}

void add_noise(PhotoStack& stack, double sigma) {
    cv::RNG random(5);
    for (cv::Mat3f& image : stack.images)
        for (cv::Vec3f& pixel : image)
            for (int c = 0; c < 3; ++c) pixel[c] += static_cast<float>(random.gaussian(sigma));
}

TEST(ShadingMaps, OfALambertSphereAreMeanAlbedoTimesR) {
    const TexturedSphere sphere = textured_sphere(90);
    const ShadingMaps maps = shade(sphere).maps;
    EXPECT_EQ(maps.texels, 6);
    EXPECT_EQ(maps.levels, 11);
    EXPECT_LT(largest_difference_to_lambert(maps), 1e-6);
    EXPECT_GT(maps.samples(2, 8), 100);
}

TEST(ShadingMaps, StateTheMeanAlbedo) {
    const TexturedSphere sphere = textured_sphere(90);
    const ShadingMaps maps = shade(sphere).maps;
    for (int k = 1; k <= 6; ++k) {
        const cv::Scalar mean = cv::mean(sphere.albedo.albedo, sphere.index.label == k);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(maps.mean_albedo(k - 1, 0)[c], mean[c], 1e-6);
    }
}

TEST(ShadingMaps, AverageNoiseOut) {
    TexturedSphere sphere = textured_sphere(90);
    add_noise(sphere.stack, 0.02);
    EXPECT_LT(largest_difference_to_lambert(shade(sphere).maps), 0.005);
}

TEST(ShadingMaps, AreNotDraggedDownByCastShadows) {
    TexturedSphere sphere = textured_sphere(90);
    for (std::size_t i = 0; i < sphere.stack.images.size(); ++i)
        sphere.stack.images[i](cv::Rect(static_cast<int>(7 * i), 0, 12, 90)) *= 0.05;
    EXPECT_LT(largest_difference_to_lambert(shade(sphere).maps), 1e-6);
}

TEST(ShadingMaps, LeaveClippedSamplesOut) {
    TexturedSphere sphere = textured_sphere(90);
    for (std::size_t i = 0; i < sphere.stack.images.size(); ++i)
        for (int y = 0; y < 90; ++y)
            for (int x = 0; x < 90; ++x) {
                cv::Vec3f& pixel = sphere.stack.images[i](y, x);
                if (std::max({pixel[0], pixel[1], pixel[2]}) < 0.45F) continue;
                sphere.stack.clipped[i](y, x) = 255;
                pixel = {0.45F, 0.45F, 0.45F};
            }
    EXPECT_LT(largest_difference_to_lambert(shade(sphere).maps), 1e-6);
}

TEST(ShadingMaps, LeaveUnusedLightsOut) {
    TexturedSphere sphere = textured_sphere(90);
    sphere.lights[3].used = false;
    sphere.lights[3].direction = {0, 0, 0};
    sphere.stack.images[3].setTo(cv::Scalar(7, 7, 7));
    EXPECT_LT(largest_difference_to_lambert(shade(sphere).maps), 1e-6);
}

TEST(ShadingMaps, DoNotGlowInTheDarkAndAreNeverNegative) {
    TexturedSphere sphere = textured_sphere(60);
    for (cv::Mat3f& image : sphere.stack.images) image += cv::Scalar(0.1, 0.1, 0.1);
    add_noise(sphere.stack, 0.05);
    const ShadingMaps maps = shade(sphere).maps;
    for (int k = 0; k < maps.texels; ++k) {
        EXPECT_EQ(maps.radiance(k, 0), cv::Vec3f(0, 0, 0));
        for (int level = 0; level < maps.levels; ++level)
            for (int c = 0; c < 3; ++c) EXPECT_GE(maps.radiance(k, level)[c], 0.0F);
    }
}

TEST(ShadingMaps, OfATexelNeverLitFallBackToItsAlbedo) {
    TexturedSphere sphere = textured_sphere(60);
    for (cv::Mat1b& clipped : sphere.stack.clipped) clipped.setTo(255, sphere.index.label == 4);
    const ShadingMaps maps = shade(sphere).maps;
    EXPECT_LT(largest_difference_to_lambert(maps), 1e-6);
    EXPECT_EQ(maps.samples(3, 5), 0);
    EXPECT_GT(maps.radiance(3, 10)[0], 0.2F);
}

TEST(ShadingMaps, SkipValuesThatAreNotNumbers) {
    TexturedSphere sphere = textured_sphere(60);
    sphere.stack.images[2](30, 30)[1] = std::nanf("");
    sphere.albedo.albedo(31, 30)[0] = std::nanf("");
    EXPECT_LT(largest_difference_to_lambert(shade(sphere).maps), 1e-6);
}

TEST(ShadingMaps, TellTheAlbedoOfALambertSpheresPixels) {
    TexturedSphere sphere = textured_sphere(60);
    const AlbedoMap truth = {sphere.albedo.albedo.clone(), sphere.albedo.valid};
    sphere.albedo.albedo(30, 30) *= 1.5;  // told wrong by whatever made the unshaded image
    const AlbedoMap told = shade(sphere).albedo;
    EXPECT_LT(cv::norm(told.albedo(cv::Rect(25, 25, 10, 10)), truth.albedo(cv::Rect(25, 25, 10, 10)), cv::NORM_INF),
              0.01);
}

TEST(ShadingMaps, PassOverNormalsThatAreNotNumbers) {
    TexturedSphere sphere = textured_sphere(60);
    sphere.normals.normal(30, 30) = cv::Vec3f::all(std::nanf(""));
    const ShadingResult shaded = shade(sphere);
    EXPECT_LT(largest_difference_to_lambert(shaded.maps), 1e-6);
    EXPECT_EQ(shaded.albedo.albedo(30, 30), sphere.albedo.albedo(30, 30));
}

TEST(ShadingMaps, OfOnePixelAreThatPixels) {
    TexturedSphere sphere = textured_sphere(61);
    const auto middle = [](const auto& map) { return map(cv::Rect(30, 30, 1, 1)).clone(); };
    for (cv::Mat3f& image : sphere.stack.images) image = middle(image);
    for (cv::Mat1b& clipped : sphere.stack.clipped) clipped = middle(clipped);
    sphere.stack.mask = middle(sphere.stack.mask);
    sphere.normals = {middle(sphere.normals.normal), middle(sphere.normals.valid)};
    sphere.albedo = {middle(sphere.albedo.albedo), middle(sphere.albedo.valid)};
    sphere.index = {cv::Mat1w(1, 1, std::uint16_t{1}), 1};
    const ShadingResult shaded = shade(sphere);
    EXPECT_LT(largest_difference_to_lambert(shaded.maps), 1e-6);
    EXPECT_LT(cv::norm(shaded.albedo.albedo, sphere.albedo.albedo, cv::NORM_INF), 1e-5);
}

TEST(ShadingMaps, OfASourceOfOneTexelAreThoseOfAllItsPixels) {
    TexturedSphere sphere = textured_sphere(60);
    sphere.index.label.setTo(1, sphere.index.label != 0);
    sphere.index.texels = 1;
    const ShadingResult shaded = shade(sphere);
    EXPECT_LT(largest_difference_to_lambert(shaded.maps), 1e-6);
    EXPECT_LT(cv::norm(shaded.albedo.albedo, sphere.albedo.albedo, cv::NORM_INF, sphere.albedo.valid), 1e-4);
}

TEST(ShadingMaps, OfAVeryLongPicture) {
    TexturedSphere strip = textured_sphere(61);
    const auto stretched = [](const auto& map) {
        std::remove_cvref_t<decltype(map)> long_map;
        cv::repeat(map(cv::Rect(29, 29, 1, 3)), 1, 5000, long_map);
        return long_map;
    };
    for (cv::Mat3f& image : strip.stack.images) image = stretched(image);
    for (cv::Mat1b& clipped : strip.stack.clipped) clipped = stretched(clipped);
    strip.stack.mask = stretched(strip.stack.mask);
    strip.normals = {stretched(strip.normals.normal), stretched(strip.normals.valid)};
    strip.albedo = {stretched(strip.albedo.albedo), stretched(strip.albedo.valid)};
    strip.index = {stretched(strip.index.label), strip.index.texels};
    const ShadingResult shaded = shade(strip);
    EXPECT_EQ(shaded.albedo.albedo.size(), cv::Size(5000, 3));
    EXPECT_LT(largest_difference_to_lambert(shaded.maps), 1e-6);
}

TEST(ShadingMaps, DrawPixelsOfOneAlbedoTogetherAndLeaveTheOthersApart) {
    TexturedSphere textured = textured_sphere(90), plain = textured_sphere(90);
    plain.albedo.albedo.setTo(cv::Scalar(0.4, 0.4, 0.4), plain.albedo.valid);
    for (std::size_t i = 0; i < plain.lights.size(); ++i)
        plain.stack.images[i] = test::lambert_photograph(plain.normals, plain.albedo, plain.lights[i]);
    // How far the told albedo is off, against one photograph's noise; 12 photographs alone leave 0.4 of it.
    const auto error = [](TexturedSphere& sphere) {
        add_noise(sphere.stack, 0.02);
        const AlbedoMap told = shade(sphere).albedo;
        const cv::Rect middle(30, 30, 30, 30);
        return cv::norm(told.albedo(middle), sphere.albedo.albedo(middle), cv::NORM_L2) / std::sqrt(2700.0) / 0.02;
    };
    EXPECT_LT(error(plain), 0.1);
    EXPECT_LT(error(textured), 0.45);
}

TEST(ShadingMaps, TakeANearLightAsItReachesThePixel) {
    TexturedSphere sphere = textured_sphere(60);
    ShadingOptions options;
    options.geometry.view = ViewGeometry{1.0, {29.5, 29.5}};
    for (std::size_t i = 0; i < sphere.lights.size(); ++i) {
        Light& light = sphere.lights[i];
        light.near = LampPosition{light.direction * 120, {0, 0, 0}};
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 60; ++x) {
                const Incidence at = incidence(light, options.geometry.point_at(y, x));
                const cv::Vec3f& n = sphere.normals.normal(y, x);
                const double r = std::max(0.0, at.direction.dot(Eigen::Vector3d(n[0], n[1], n[2])));
                for (int c = 0; c < 3; ++c)
                    sphere.stack.images[i](y, x)[c] =
                        static_cast<float>(sphere.albedo.albedo(y, x)[c] * r * at.falloff * light.intensity[c]);
            }
    }
    EXPECT_LT(largest_difference_to_lambert(shade(sphere, options).maps), 1e-6);
    EXPECT_THROW(shade(sphere), InputError);
}

void expect_same_bits(const ShadingResult& a, const ShadingResult& b) {
    EXPECT_EQ(cv::norm(a.albedo.albedo, b.albedo.albedo, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a.maps.radiance, b.maps.radiance, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a.maps.samples, b.maps.samples, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a.maps.mean_albedo, b.maps.mean_albedo, cv::NORM_INF), 0);
}

ShadingResult shade_by_bands(PhotoSource& photos, const TexturedSphere& s, const ShadingBands& bands,
                             const WorkContext& work = {}) {
    return shading_maps(photos, s.lights, s.normals, s.albedo, s.index, {}, bands, work);
}

TEST(ShadingMaps, SameBitsForAnyHeightOfBandsAndAnyNumberOfThreads) {
    TexturedSphere sphere = textured_sphere(90);
    add_noise(sphere.stack, 0.02);
    const ShadingResult whole = shade(sphere);
    for (const int rows : {1, 7, 89, 90, 1000})
        for (const int threads : {1, 2, 8}) {
            WorkContext work;
            work.threads = threads;
            ShadingBands bands;
            bands.rows = rows;
            PhotosInMemory photos(sphere.stack);
            expect_same_bits(shade_by_bands(photos, sphere, bands, work), whole);
        }
}

/// The sphere as a camera would store it: 8 and 16 bits, some by a curve, some above a dark frame, one floating point.
std::vector<PhotoRows> as_decoded(const PhotoStack& stack) {
    auto curve = std::make_shared<std::vector<float>>(256);
    for (std::size_t i = 0; i < 256; ++i) (*curve)[i] = static_cast<float>(i * i) / 65025.0F;
    std::vector<PhotoRows> photos;
    for (std::size_t i = 0; i < stack.images.size(); ++i) {
        PhotoRows& photo = photos.emplace_back();
        const bool narrow = i % 3 == 0;
        if (i % 3 == 2) {
            photo.samples = stack.images[i];
            continue;
        }
        const double full = narrow ? 255 : 65535;
        stack.images[i].convertTo(photo.samples, narrow ? CV_8U : CV_16U, full);
        photo.black = 3;
        photo.scale = static_cast<float>(1 / full);
        photo.limit = static_cast<float>(0.5 * full);
        if (i % 2 == 0 && narrow) photo.curve = curve;
        if (i % 4 == 1) photo.dark = cv::Mat3f(stack.size(), cv::Vec3f(1.5F, 2.5F, 3.5F));
    }
    return photos;
}

TEST(ShadingMaps, OfPhotographsAsDecodedAreThoseOfTheirRadiance) {
    TexturedSphere sphere = textured_sphere(60);
    add_noise(sphere.stack, 0.02);
    const std::vector<PhotoRows> decoded = as_decoded(sphere.stack);
    for (std::size_t i = 0; i < decoded.size(); ++i) {
        sphere.stack.images[i] = radiance_of(decoded[i]);
        sphere.stack.clipped[i] = clipped_of(decoded[i]);
    }
    PhotosInMemory photos(decoded, sphere.stack.files, sphere.stack.mask);
    ShadingBands bands;
    bands.rows = 11;
    expect_same_bits(shade_by_bands(photos, sphere, bands), shade(sphere));
}

/// Photographs that say what their rows take, and how they were read.
class CountingPhotos : public PhotosInMemory {
public:
    CountingPhotos(const PhotoStack& stack, std::size_t bytes_per_row) : PhotosInMemory(stack), bytes_(bytes_per_row) {}
    std::size_t bytes_per_row() const override { return bytes_; }
    void read_next(int rows, PhotoBand& band) override {
        most_rows = std::max(most_rows, rows);
        PhotosInMemory::read_next(rows, band);
    }
    void rewind() override {
        ++rewinds;
        PhotosInMemory::rewind();
    }
    int most_rows = 0, rewinds = 0;

private:
    std::size_t bytes_;
};

TEST(ShadingMaps, ReadPhotographsOnceWhereTheMemoryHoldsThem) {
    const TexturedSphere sphere = textured_sphere(90);
    ShadingBands bands;
    bands.memory_mib = 100;
    CountingPhotos few(sphere.stack, std::size_t{1} << 20), many(sphere.stack, std::size_t{2} << 20);
    const ShadingResult whole = shade_by_bands(few, sphere, bands), banded = shade_by_bands(many, sphere, bands);
    EXPECT_EQ(few.most_rows, 90);
    EXPECT_EQ(few.rewinds, 0);
    EXPECT_LE(2 * 2 * many.most_rows, 100) << "two bands";
    EXPECT_EQ(many.rewinds, 2);
    expect_same_bits(whole, banded);
    bands.memory_mib = 3;
    EXPECT_THAT(test::input_error_of([&] { shade_by_bands(many, sphere, bands); }),
                testing::HasSubstr("memory_mib is 3"));
}

TEST(ShadingMaps, SameBitsOnAnyNumberOfThreads) {
    TexturedSphere sphere = textured_sphere(90);
    add_noise(sphere.stack, 0.02);
    WorkContext work;
    work.threads = 1;
    const ShadingResult first = shade(sphere, {}, work);
    const ShadingMaps& one = first.maps;
    for (const int threads : {2, 8}) {
        work.threads = threads;
        const ShadingResult again = shade(sphere, {}, work);
        const ShadingMaps& many = again.maps;
        EXPECT_EQ(cv::norm(first.albedo.albedo, again.albedo.albedo, cv::NORM_INF), 0);
        EXPECT_EQ(cv::norm(one.radiance, many.radiance, cv::NORM_INF), 0);
        EXPECT_EQ(cv::norm(one.samples, many.samples, cv::NORM_INF), 0);
    }
}

TEST(ShadingMaps, RefuseInputsThatDoNotAgree) {
    const TexturedSphere good = textured_sphere(30);
    TexturedSphere bad = good;
    bad.lights.pop_back();
    EXPECT_THROW(shade(bad), InputError);
    bad = good;
    bad.normals.normal = cv::Mat3f(10, 10);
    EXPECT_THROW(shade(bad), InputError);
    bad = good;
    bad.index.label = cv::Mat1w(29, 30, std::uint16_t{1});
    EXPECT_THROW(shade(bad), InputError);
    bad = good;
    bad.index.texels = 5;
    EXPECT_THROW(shade(bad), InputError);
    bad = good;
    bad.lights[1].intensity = {1, 0, 1};
    EXPECT_THROW(shade(bad), InputError);
    bad = good;
    bad.lights[1].direction *= 2;
    EXPECT_THROW(shade(bad), InputError);
}

TEST(ShadingMaps, StopWhenAsked) {
    std::stop_source stop;
    stop.request_stop();
    WorkContext work;
    work.stop = stop.get_token();
    EXPECT_THROW(shade(textured_sphere(30), {}, work), Cancelled);
}

TEST(ShadingOptions, NameTheFieldAndItsRange) {
    ShadingOptions options;
    options.levels = 1;
    EXPECT_THAT([&] { options.validate(); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr("levels is 1, allowed are 2...256")));
}

}  // namespace
}  // namespace darkbox
