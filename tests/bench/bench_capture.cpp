#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "acquisition/device/unique_fd.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/frame_file.h"
#include "acquisition/session/sha256.h"
#include "rig/capture/picture_check.h"
#include "rig/capture/session_recorder.h"
#include "sim/quick_sensor.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Stopwatch = std::chrono::steady_clock;

constexpr int frames = 64;
constexpr std::size_t samples = std::size_t{1920} * 1080;
constexpr double camera_rate = 30;  ///< frames a second

/// In $TMPDIR, or here: name the disk that is to be measured.
class Folder {
public:
    Folder()
        : path_((std::getenv("TMPDIR") != nullptr ? fs::temp_directory_path() : fs::current_path()) / "bench-XXXXXX") {
        std::string name = path_.string();
        if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder to write in");
        path_ = name;
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() { fs::remove_all(path_); }
    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

/// Samples that no file system could make smaller.
std::vector<std::byte> noise() {
    std::vector<std::byte> pixels(2 * samples);
    std::mt19937 random(5);
    for (std::byte& b : pixels) b = static_cast<std::byte>(random());
    return pixels;
}

Frame frame_of(const std::vector<std::byte>& pixels) {
    Frame frame;
    frame.width = 1920;
    frame.height = 1080;
    frame.format = PixelFormat::rggb16;
    frame.pixels = pixels;
    return frame;
}

FrameRecord record_of(int number) {
    FrameRecord record;
    record.file = "frames/" + std::to_string(number) + ".tif";
    record.kind = FrameKind::lit;
    record.lamp = LampId{static_cast<std::uint32_t>(number)};
    record.lamp_name = "lamp-" + std::to_string(number);
    record.verified = true;
    return record;
}

double seconds_since(Stopwatch::time_point begin) {
    return std::chrono::duration<double>(Stopwatch::now() - begin).count();
}

/// The same bytes, each frame a file that is flushed, and no more.
double plain_seconds(const std::vector<std::byte>& pixels) {
    const Folder folder;
    const auto begin = Stopwatch::now();
    for (int i = 0; i < frames; ++i) {
        const fs::path file = folder.path() / std::to_string(i);
        const UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
        write_all(fd.get(), pixels, file);
        ::fsync(fd.get());
    }
    return seconds_since(begin);
}

/// A capture's 64 frames, as fast as the queue takes them, until the last is acknowledged.
double session_seconds(const std::vector<std::byte>& pixels, std::size_t& most_queued) {
    const Folder folder;
    SessionInfo info;
    info.source = "capture";
    info.created = iso8601_now();
    info.planned_shots = frames;
    SessionWriter writer = SessionWriter::create(folder.path() / "session", info);
    std::vector<Frame> shots;
    for (int i = 0; i < frames; ++i) shots.push_back(frame_of(pixels));
    const auto begin = Stopwatch::now();
    SessionRecorder recorder(writer);
    for (int i = 0; i < frames; ++i) recorder.add(std::move(shots[static_cast<std::size_t>(i)]), record_of(i));
    recorder.finish();
    most_queued = recorder.most_queued();
    return seconds_since(begin);
}

/// Both in turn, so that what else the disk does hits both.
void write_session(benchmark::State& state) {
    const std::vector<std::byte> pixels = noise();
    double session = 0, plain = 0;
    std::size_t most_queued = 0;
    for (auto _ : state) {
        plain += plain_seconds(pixels);
        const double seconds = session_seconds(pixels, most_queued);
        session += seconds;
        state.SetIterationTime(seconds);
    }
    const double count = frames * static_cast<double>(state.iterations());
    const double megabytes = 1e-6 * static_cast<double>(pixels.size()) * count;
    state.counters["MB_per_second"] = megabytes / session;
    state.counters["plain_MB_per_second"] = megabytes / plain;
    state.counters["share_of_plain"] = plain / session;
    state.counters["times_30_frames"] = count / session / camera_rate;
    state.counters["most_queued_MB"] = 1e-6 * static_cast<double>(most_queued);
}

void encode(benchmark::State& state) {
    const Frame frame = frame_of(noise());
    for (auto _ : state) benchmark::DoNotOptimize(encode_frame_tiff(frame));
}

void checksum(benchmark::State& state) {
    const std::vector<std::byte> pixels = noise();
    for (auto _ : state) benchmark::DoNotOptimize(sha256_hex(pixels));
}

/// A frame under one lamp, and one that saw a switch.
void expose_quickly(benchmark::State& state) {
    const auto lights = static_cast<std::size_t>(state.range(0));
    const std::vector<float> light(samples, 0.3F);
    std::vector<std::uint16_t> exposed(samples);
    sim::Sensor sensor;
    sensor.bit_depth = 16;
    const sim::QuickSensor quick(1);
    const std::vector<sim::LightShare> shares(lights, {1.0F / static_cast<float>(lights), light});
    std::uint64_t frame = 0;
    for (auto _ : state) {
        quick.expose(sensor, shares, {0.02, 1.0, ++frame}, exposed);
        benchmark::ClobberMemory();
    }
}

/// What predictive mode does with each picture, four lamps by turns.
void look_at_picture(benchmark::State& state) {
    sim::Sensor sensor;
    sensor.bit_depth = 16;
    sensor.black_level = 1024;
    const sim::QuickSensor quick(1);
    std::uint64_t number = 0;
    const auto shot = [&](int lamp) {
        std::vector<float> light(samples, 0.0F);
        for (std::size_t i = 0; lamp > 0 && i < samples; ++i)
            light[i] = 0.1F + 0.1F * static_cast<float>((i / 97) % static_cast<std::size_t>(lamp + 1));
        std::vector<std::uint16_t> exposed(samples);
        quick.expose(sensor, {{{1.0F, light}}}, {0.02, 1.0, ++number}, exposed);
        const auto bytes = std::as_bytes(std::span(exposed));
        return frame_of({bytes.begin(), bytes.end()});
    };
    CameraInfo camera;
    camera.bit_depth = 16;
    camera.black_level = 1024;
    PictureCheck check(camera, {});
    check.accept_dark(shot(0));
    std::vector<Frame> frames_of_lamps;
    for (int i = 0; i < frames; ++i) frames_of_lamps.push_back(shot(1 + i % 4));
    const Frame confirming = shot(1);
    check.accept_lit("lamp-1", shot(1), &confirming);
    std::size_t next = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(check.accept_lit("lamp-" + std::to_string(1 + next % 4), frames_of_lamps[next]));
        ++next;
    }
}

BENCHMARK(write_session)->UseManualTime()->Iterations(3)->Unit(benchmark::kMillisecond);
BENCHMARK(encode)->Unit(benchmark::kMillisecond);
BENCHMARK(checksum)->Unit(benchmark::kMillisecond);
BENCHMARK(expose_quickly)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);
BENCHMARK(look_at_picture)->Iterations(frames)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace darkbox
