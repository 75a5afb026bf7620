#include "sim/truth.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "acquisition/device/device_error.h"
#include "sim/renderer.h"

namespace darkbox::sim {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void throw_unwritable(const fs::path& file, const std::string& reason) {
    throw DeviceError(fmt::format("cannot write {}: {}", file.string(), reason),
                      "check the folder's permissions and the free space");
}

void write_exr(const RgbImage& image, const fs::path& file) {
    try {
        Imf::Header header(image.width, image.height);
        Imf::FrameBuffer buffer;
        constexpr std::size_t pixel = 3 * sizeof(float);
        auto* base = reinterpret_cast<char*>(const_cast<float*>(image.samples.data()));  // OpenEXR only reads it
        for (int i = 0; i < 3; ++i) {
            constexpr const char* names[] = {"R", "G", "B"};
            header.channels().insert(names[i], Imf::Channel(Imf::FLOAT));
            buffer.insert(names[i], Imf::Slice(Imf::FLOAT, base + i * sizeof(float), pixel,
                                               pixel * static_cast<std::size_t>(image.width)));
        }
        Imf::OutputFile output(file.c_str(), header);
        output.setFrameBuffer(buffer);
        output.writePixels(image.height);
    } catch (const std::exception& e) {
        throw_unwritable(file, e.what());
    }
}

void write_mask(const SceneTruth& truth, const fs::path& file) {
    cv::Mat1b mask(truth.normals.height, truth.normals.width);
    std::transform(truth.mask.begin(), truth.mask.end(), mask.begin(),
                   [](char inside) { return static_cast<unsigned char>(inside != 0 ? 255 : 0); });
    if (!cv::imwrite(file.string(), mask)) throw_unwritable(file, "the picture library refused");
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
    if (scene.ball) {
        const BallCircle circle = ball_circle(scene.view, scene.ball->sphere);
        balls.push_back({{"x", circle.centre.u}, {"y", circle.centre.v}, {"radius", circle.radius}});
    }
    return nlohmann::json{{"balls", balls}}.dump(2) + "\n";
}

}  // namespace

void write_truth(const Scene& scene, const std::vector<ExposureTruth>& exposures, const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed) throw_unwritable(folder, failed.message());
    const SceneTruth truth = render_truth(scene);
    write_exr(truth.normals, folder / "normals.exr");
    write_exr(truth.albedo, folder / "albedo.exr");
    write_mask(truth, folder / "mask.png");
    write_text(lights_lp(scene), folder / "lights.lp");
    write_text(lamps_json(scene, exposures), folder / "lamps.json");
    write_text(ball_json(scene), folder / "ball.json");
}

}  // namespace darkbox::sim
