#include "tests/rig/cli/captured_frames.h"

#include <gtest/gtest.h>

#include <cstring>
#include <iterator>
#include <vector>

#include "acquisition/session/frame_file.h"
#include "rig/description/rig_description.h"

namespace darkbox::test {
namespace {

namespace fs = std::filesystem;

void replace(std::string& text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    ASSERT_NE(at, text.npos) << from;
    text.replace(at, from.size(), to);
}

std::vector<std::uint16_t> samples(const Session& session, const FrameRecord& record) {
    const Frame frame = read_frame(session.path_of(record), record);
    std::vector<std::uint16_t> result(frame.pixels.size() / sizeof(std::uint16_t));
    std::memcpy(result.data(), frame.pixels.data(), result.size() * sizeof(std::uint16_t));
    return result;
}

}  // namespace

std::string small_rig(int lamps) {
    std::string toml = simulated_rig_toml(lamps);
    replace(toml, "width = 320", "width = 160");
    replace(toml, "height = 240", "height = 120");
    replace(toml, "mm_per_pixel = 0.625", "mm_per_pixel = 1.25");
    return toml;
}

std::size_t frames_on_disk(const fs::path& session) {
    std::error_code absent;
    const fs::directory_iterator frames(session / "data" / "frames", absent);
    return absent ? 0 : static_cast<std::size_t>(std::distance(frames, fs::directory_iterator()));
}

double difference_in_noise(const Session& a, const FrameRecord& in_a, const Session& b, const FrameRecord& in_b) {
    const SimDescription sensor;
    const double full_scale = (1 << sensor.bit_depth) - 1;
    const double per_electron = full_scale / sensor.full_well_e;
    const double rounding = 1.0 / 12;
    const auto first = samples(a, in_a);
    const auto second = samples(b, in_b);
    EXPECT_EQ(first.size(), second.size());
    double sum = 0;
    std::size_t used = 0;
    for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i) {
        const double mean = 0.5 * (first[i] + second[i]);
        if (mean > 0.98 * full_scale) continue;  // a clipped sample has no noise
        const double electrons = std::max(0.0, mean - in_a.black_level) / per_electron;
        const double shot_and_read = electrons + sensor.read_noise_e * sensor.read_noise_e;
        const double variance = 2 * (per_electron * per_electron * shot_and_read + rounding);
        const double difference = static_cast<double>(first[i]) - second[i];
        sum += difference * difference / variance;
        ++used;
    }
    EXPECT_GT(used, first.size() / 2);
    return sum / static_cast<double>(used);
}

void expect_same_light(const Session& session, const Session& reference) {
    EXPECT_NO_THROW(session.verify());
    ASSERT_EQ(session.frames().size(), reference.frames().size());
    for (std::size_t i = 0; i < session.frames().size(); ++i) {
        const FrameRecord& frame = session.frames()[i];
        const FrameRecord& expected = reference.frames()[i];
        EXPECT_EQ(frame.file, expected.file);
        EXPECT_EQ(frame.lamp_name, expected.lamp_name);
        EXPECT_TRUE(frame.verified) << frame.file;
        EXPECT_LT(difference_in_noise(session, frame, reference, expected), 1.15) << frame.file;
    }
}

}  // namespace darkbox::test
