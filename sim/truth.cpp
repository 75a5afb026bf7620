#include "sim/truth.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <fmt/format.h>

#include <fstream>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "acquisition/device/device_error.h"
#include "processing/formats/png.h"
#include "sim/renderer.h"

namespace darkbox::sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_unwritable(const fs::path& file, const std::string& reason) {
    throw DeviceError(fmt::format("cannot write {}: {}", file.string(), reason),
                      "check the folder's permissions and the free space");
}

/// Float samples, interleaved, under the channels' names.
void write_exr(const std::vector<float>& samples, int width, std::initializer_list<const char*> channels,
               const fs::path& file) {
    try {
        const std::size_t pixel = channels.size() * sizeof(float), row = pixel * static_cast<std::size_t>(width);
        Imf::Header header(width, static_cast<int>(samples.size() * sizeof(float) / row));
        Imf::FrameBuffer buffer;
        auto* base = reinterpret_cast<char*>(const_cast<float*>(samples.data()));  // OpenEXR only reads it
        for (const char* name : channels) {
            header.channels().insert(name, Imf::Channel(Imf::FLOAT));
            buffer.insert(name, Imf::Slice(Imf::FLOAT, base, pixel, row));
            base += sizeof(float);
        }
        Imf::OutputFile output(file.c_str(), header);
        output.setFrameBuffer(buffer);
        output.writePixels(header.dataWindow().max.y + 1);
    } catch (const std::exception& e) {
        throw_unwritable(file, e.what());
    }
}

void write_mask(const SceneTruth& truth, const fs::path& file) {
    cv::Mat1b mask(truth.normals.height, truth.normals.width);
    std::transform(truth.mask.begin(), truth.mask.end(), mask.begin(),
                   [](char inside) { return static_cast<unsigned char>(inside != 0 ? 255 : 0); });
    write_png(file, mask);
}

void write_materials(const SceneTruth& truth, const fs::path& file) {
    cv::Mat1w materials(truth.normals.height, truth.normals.width);
    std::copy(truth.materials.begin(), truth.materials.end(), materials.begin());
    write_png(file, materials);
}

void write_text(const std::string& text, const fs::path& file) {
    std::ofstream stream(file, std::ios::binary);
    stream << text << std::flush;
    if (!stream) throw_unwritable(file, "the file does not take the bytes");
}

std::string lights_lp(const Scene& scene) {
    std::string text = fmt::format("{}\n", scene.lamps.size());
    for (const SceneLamp& lamp : scene.lamps) {
        const Vec3 l = direction_at_origin(lamp);
        text += fmt::format("{} {:.9f} {:.9f} {:.9f}\n", lamp.name, l.x, l.y, l.z);
    }
    return text;
}

std::string lamps_json(const Scene& scene, const std::vector<ExposureTruth>& exposures) {
    nlohmann::json frames = nlohmann::json::array();
    for (const ExposureTruth& exposure : exposures) {
        nlohmann::json lamps = nlohmann::json::array();
        for (const LampShare& b : exposure.lamps)
            lamps.push_back({{"lamp", b.lamp.value}, {"name", scene.lamps.at(b.lamp.value).name}, {"share", b.share}});
        frames.push_back({{"sequence", exposure.sequence},
                          {"timestamp_ns", exposure.timestamp.time_since_epoch().count()},
                          {"lamps", lamps}});
    }
    return nlohmann::json{{"frames", frames}}.dump(2) + "\n";
}

std::string ball_json(const Scene& scene) {
    nlohmann::json balls = nlohmann::json::array();
    for (const MirrorBall& ball : scene.balls) {
        const BallCircle circle = ball_circle(scene.view, ball.sphere);
        const Vec3& centre = ball.sphere.centre;
        balls.push_back({{"x", circle.centre.u},
                         {"y", circle.centre.v},
                         {"radius", circle.radius},
                         {"centre_mm", {centre.x, centre.y, centre.z}},
                         {"radius_mm", ball.sphere.radius_mm}});
    }
    return nlohmann::json{{"balls", balls}}.dump(2) + "\n";
}

}  // namespace

void write_truth(const Scene& scene, const std::vector<ExposureTruth>& exposures, const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed) throw_unwritable(folder, failed.message());
    const SceneTruth truth = render_truth(scene);
    write_exr(truth.normals.samples, truth.normals.width, {"R", "G", "B"}, folder / "normals.exr");
    write_exr(truth.albedo.samples, truth.albedo.width, {"R", "G", "B"}, folder / "albedo.exr");
    write_exr(truth.heights, truth.normals.width, {"Y"}, folder / "height.exr");
    write_mask(truth, folder / "mask.png");
    write_materials(truth, folder / "texels.png");
    write_text(lights_lp(scene), folder / "lights.lp");
    write_text(lamps_json(scene, exposures), folder / "lamps.json");
    write_text(ball_json(scene), folder / "ball.json");
}

}  // namespace darkbox::sim
