#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/daemon/catalog.h"

namespace darkbox {

/// What is on disk of one session, for the catalogue.
struct ScannedSession {
    SessionListing listing;
    std::vector<CatalogFrame> frames;
    std::optional<CatalogCalibration> calibration;
};

/// Changes whenever the session's state, frames or calibration do; empty when the folder is no session. A few stat()
/// calls.
std::string session_stamp(const std::filesystem::path& session);

/// Never throws for a damaged session: the listing says so. No value when the folder is no session.
std::optional<ScannedSession> scan_session(const std::filesystem::path& session);

/// Changes whenever an entry of the folder comes or goes.
std::string folder_stamp(const std::filesystem::path& folder);

}  // namespace darkbox
