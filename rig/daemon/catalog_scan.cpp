#include "rig/daemon/catalog_scan.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>

#include "acquisition/frame/error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/session.h"
#include "processing/formats/calibration_file.h"
#include "processing/pipeline/session_files.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

std::string stamp_of(const fs::path& path) {
    struct stat there{};
    if (::lstat(path.c_str(), &there) != 0) return "-";
    return fmt::format("{}.{}.{}.{}", there.st_ino, there.st_size, there.st_mtim.tv_sec, there.st_mtim.tv_nsec);
}

CatalogFrame catalogued(const FrameRecord& record) {
    return {.file = record.file,
            .kind = std::string(name(record.kind)),
            .lamp = record.lamp_name,
            .format = record.format,
            .width = record.width,
            .height = record.height,
            .exposure_s = record.exposure_s,
            .gain = record.gain,
            .sequence = record.sequence,
            .timestamp_ns = record.timestamp_ns,
            .verified = record.verified,
            .sha256 = record.sha256};
}

double median_sigma_deg(const Lights& lights) {
    std::vector<double> sigmas;
    for (const Light& light : lights)
        if (light.used) sigmas.push_back(light.sigma_deg());
    if (sigmas.empty()) return 0;
    const auto middle = sigmas.begin() + static_cast<std::ptrdiff_t>(sigmas.size() / 2);
    std::ranges::nth_element(sigmas, middle);
    return *middle;
}

/// A calibration that does not read is left out: it is derived, and calibrating again mends it.
std::optional<CatalogCalibration> scan_calibration(const fs::path& session, const SessionListing& listing) {
    const fs::path file = ResultFiles(session).calibration;
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return std::nullopt;
    try {
        const StoredCalibration stored = read_calibration(file);
        const Lights& lights = stored.calibration.lights;
        return CatalogCalibration{.session = listing.name,
                                  .created = listing.created,
                                  .rig = stored.rig.name,
                                  .lamps = lights.size(),
                                  .used = static_cast<std::size_t>(std::ranges::count(lights, true, &Light::used)),
                                  .condition_number = stored.calibration.condition_number,
                                  .sigma_deg = median_sigma_deg(lights),
                                  .intensities_known = stored.calibration.intensity_origin != IntensityOrigin::unknown,
                                  .warnings = stored.calibration.warnings.size()};
    } catch (const Error&) {
        return std::nullopt;
    }
}

}  // namespace

std::string session_stamp(const fs::path& session) {
    const std::string seal = stamp_of(session / tag_manifest_name);
    const std::string journal = stamp_of(session / journal_name);
    if (seal == "-" && journal == "-") return "";
    return fmt::format("{} {} {} {}", seal, journal, stamp_of(session / "data" / session_file_name),
                       stamp_of(ResultFiles(session).calibration));
}

std::string folder_stamp(const fs::path& folder) { return stamp_of(folder); }

std::optional<ScannedSession> scan_session(const fs::path& folder) {
    const auto listing = describe_session(folder);
    if (!listing) return std::nullopt;
    ScannedSession scanned{.listing = *listing, .frames = {}, .calibration = {}};
    if (listing->state != SessionListing::State::sealed) return scanned;
    try {
        const Session session = Session::open(folder);
        for (const FrameRecord& record : session.frames()) scanned.frames.push_back(catalogued(record));
    } catch (const Error& error) {  // it opened a moment ago: somebody changes it now
        scanned.listing.state = SessionListing::State::damaged;
        scanned.listing.problem = error.what();
    }
    scanned.calibration = scan_calibration(folder, *listing);
    return scanned;
}

}  // namespace darkbox
