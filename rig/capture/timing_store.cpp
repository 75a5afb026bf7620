#include "rig/capture/timing_store.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "acquisition/frame/error.h"
#include "acquisition/session/durable_file.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

std::string from_environment(const char* name) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing sets it
    return value ? value : "";
}

/// What a timing holds for. Rates and exposures in whole units, so that equal ones are written alike.
std::string key_of(const CameraInfo& camera) {
    return fmt::format("{}, {}, {}x{} {}, {:.2f} frames a second, {:.0f} us", camera.id, camera.driver, camera.width,
                       camera.height, name(camera.format), 1.0 / camera.frame_period.count(),
                       camera.controls.exposure.count() * 1e6);
}

Json read_store(const fs::path& file) {
    std::error_code error;
    if (!fs::exists(file, error)) return Json::object();
    std::ifstream in(file);
    Json store = Json::parse(in, nullptr, /*allow_exceptions=*/false);
    if (!store.is_object())
        throw InputError(fmt::format("{} holds no measured timings", file.string()),
                         "remove it, and measure again: darkbox rig measure-latency");
    return store;
}

}  // namespace

fs::path default_timing_file() {
    if (const std::string folder = from_environment("DARKBOX_STATE"); !folder.empty())
        return fs::path(folder) / "timing.json";
    if (const std::string folder = from_environment("STATE_DIRECTORY"); !folder.empty())
        return fs::path(folder.substr(0, folder.find(':'))) / "timing.json";
    const std::string state = from_environment("XDG_STATE_HOME");
    const fs::path base = state.empty() ? fs::path(from_environment("HOME")) / ".local" / "state" : fs::path(state);
    return base / "darkbox" / "timing.json";
}

void store_timing(const fs::path& file, const LatencyReport& report) {
    Json store = read_store(file);
    store[key_of(report.camera)] = {{"begin_from_stamp_ns", report.timing.begin_from_stamp.count()},
                                    {"end_from_stamp_ns", report.timing.end_from_stamp.count()},
                                    {"readout_ns", report.timing.readout.count()},
                                    {"margin_ns", report.timing.margin.count()},
                                    {"measured", iso8601_now()}};
    fs::create_directories(file.parent_path());
    const std::string text = store.dump(2) + "\n";
    write_durably(file, std::as_bytes(std::span(text)));
}

std::optional<MeasuredTiming> stored_timing(const fs::path& file, const CameraInfo& camera) {
    const Json store = read_store(file);
    const auto found = store.find(key_of(camera));
    if (found == store.end()) return std::nullopt;
    const auto value = [&](const char* key) {
        const auto number = found->is_object() ? found->find(key) : found->end();
        if (!found->is_object() || number == found->end() || !number->is_number_integer())
            throw InputError(fmt::format("{}: \"{}\" has no {}", file.string(), found.key(), key),
                             "remove the file, and measure again: darkbox rig measure-latency");
        return Nanoseconds(number->get<std::int64_t>());
    };
    MeasuredTiming timing;
    timing.begin_from_stamp = value("begin_from_stamp_ns");
    timing.end_from_stamp = value("end_from_stamp_ns");
    timing.readout = value("readout_ns");
    timing.margin = value("margin_ns");
    return timing;
}

}  // namespace darkbox
