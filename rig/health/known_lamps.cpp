#include "rig/health/known_lamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "acquisition/frame/error.h"
#include "acquisition/session/session.h"
#include "processing/formats/calibration_file.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr double described_sigma_deg = 3.0;  ///< some 50 mm at a metre
constexpr double described_moved_deg = 12.0;
/// Distant lamps that are none shine on each place of the ball from elsewhere.
constexpr double taken_as_distant_sigma_deg = 3.0;
constexpr double taken_as_distant_moved_deg = 10.0;
constexpr std::size_t most_looked_at = 32;  ///< sessions, the latest first

struct Candidate {
    fs::path session;
    fs::file_time_type written;
};

std::vector<Candidate> candidates(const fs::path& sessions, const std::string& except) {
    std::vector<Candidate> found;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(sessions, error)) {
        if (entry.path().filename() == except || !entry.is_directory(error)) continue;
        const fs::file_time_type written = fs::last_write_time(ResultFiles(entry.path()).calibration, error);
        if (!error) found.push_back({entry.path(), written});
    }
    std::ranges::sort(found, [](const Candidate& a, const Candidate& b) {
        return a.written != b.written ? a.written > b.written : a.session < b.session;
    });
    if (found.size() > most_looked_at) found.resize(most_looked_at);
    return found;
}

bool all_verified(const fs::path& folder, const RigDescription& rig) {
    const Session session = Session::open(folder);
    return session.info().source == "capture" && session.info().rig == rig.name &&
           std::ranges::all_of(session.frames(), [](const FrameRecord& f) { return !f.lamp || f.verified; });
}

/// None where its lights were not read off a ball: they came from elsewhere then.
std::optional<KnownLamps> lamps_of(const Candidate& candidate, const RigDescription& rig) {
    StoredCalibration stored = read_calibration(ResultFiles(candidate.session).calibration);
    if (stored.calibration.balls.empty() || stored.rig.name != rig.name) return std::nullopt;
    if (!all_verified(candidate.session, rig)) return std::nullopt;
    KnownLamps known;
    known.source = fmt::format("the calibration of {}", candidate.session.filename().string());
    known.camera_known = true;
    const bool near = std::ranges::any_of(stored.calibration.lights, [](const Light& l) { return l.near.has_value(); });
    if (!near && !rig.distant_lamps) {
        known.sigma_deg = taken_as_distant_sigma_deg;
        known.moved_deg = taken_as_distant_moved_deg;
    }
    known.lights = {std::move(stored.rig), std::move(stored.calibration.lights), false};
    return known;
}

}  // namespace

KnownLamps described_lamps(const RigDescription& rig) {
    KnownLamps known;
    known.source = "rig.toml";
    known.sigma_deg = described_sigma_deg;
    known.moved_deg = described_moved_deg;
    known.lights.rig.name = rig.name;
    for (const LampDescription& lamp : rig.lamps) {
        const Eigen::Vector3d place(lamp.position_mm[0], lamp.position_mm[1], lamp.position_mm[2]);
        Light light;
        light.file = lamp.name;
        light.direction = place.normalized();
        if (!rig.distant_lamps) light.near = LampPosition{.position_mm = place};
        known.lights.rig.lamps.push_back(lamp.name);
        known.lights.lights.push_back(light);
    }
    return known;
}

std::optional<KnownLamps> calibrated_lamps(const fs::path& sessions, const RigDescription& rig,
                                           const std::string& except) {
    for (const Candidate& candidate : candidates(sessions, except)) {
        try {
            if (auto known = lamps_of(candidate, rig)) return known;
        } catch (const Error&) {
            continue;  // damaged, or being made at this moment: another one will do
        }
    }
    return std::nullopt;
}

}  // namespace darkbox
