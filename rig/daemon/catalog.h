#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rig/daemon/session_folder.h"

namespace darkbox {

/// One frame as the catalogue knows it; a subset of FrameRecord.
struct CatalogFrame {
    std::string file = {};  ///< below the session's data/
    std::string kind = {};
    std::string lamp = {};
    std::string format = {};
    int width = 0;  ///< pixels
    int height = 0;
    double exposure_s = 0;
    double gain = 1;
    std::uint64_t sequence = 0;
    std::int64_t timestamp_ns = 0;
    bool verified = false;
    std::string sha256 = {};
};

/// A session's calibration in one line.
struct CatalogCalibration {
    std::string session = {};
    std::string created = {};  ///< of the session, ISO 8601, UTC
    std::string rig = {};
    std::size_t lamps = 0;
    std::size_t used = 0;
    double condition_number = 0;
    double sigma_deg = 0;  ///< median over the used lamps; 0 = not known
    bool intensities_known = false;
    std::size_t warnings = 0;
};

/// What a comparison of a calibration with an earlier one of one rig said.
struct CatalogDrift {
    std::string session = {};
    std::string against = {};  ///< the earlier session
    std::string role = {};     ///< "last" or "first": which earlier calibration that is
    bool steady = true;
    std::string alarm = {};  ///< in words; empty: within the thresholds
    std::string findings_json = {};
};

/// A request for some of a list: what follows `after` in the list's order.
struct PageRequest {
    std::string after = {};  ///< a name, or a job's id; empty = from the start
    std::size_t limit = 100;
};

/// The index over a folder of sessions: what lies in SQLite is copied from the sessions and can be made again from them
/// at any time; the jobs' table beside it (see job_store.h) is the one thing that lives here alone. It lies in
/// FOLDER/.darkbox/catalog.sqlite, survives SIGKILL at any moment, and is made anew where it is damaged.
/// Thread-safe. Functions throw DeviceError when the disk refuses.
class Catalog {
public:
    enum class Place { on_disk, in_memory };

    /// Opens, migrates, or makes it; does not look at the sessions yet. Throws InputError for one of a newer darkbox.
    explicit Catalog(std::filesystem::path folder, Place place = Place::on_disk);
    Catalog(const Catalog&) = delete;
    Catalog& operator=(const Catalog&) = delete;
    ~Catalog();

    /// Reads every session that changed on disk since it was last read; forgets those that are gone.
    void refresh();
    /// The same for one session.
    void refresh(const std::string& session);
    /// Cheap while nothing was added to or removed from the folder since the last refresh().
    void refresh_if_changed();
    /// Forgets everything but the jobs and reads all sessions again.
    void rebuild();

    /// By name. `find`: only those that have all of these words in their name, object, inventory number or Dublin Core;
    /// upper and lower case are the same for letters of ASCII.
    std::vector<SessionListing> sessions(const PageRequest& page, const std::string& find = {}) const;
    std::optional<SessionListing> session(const std::string& name) const;
    std::size_t session_count(const std::string& find = {}) const;
    std::vector<CatalogFrame> frames(const std::string& session) const;

    /// Oldest first.
    std::vector<CatalogCalibration> calibrations(const PageRequest& page) const;
    /// Against the last earlier calibration of the same rig and against its first. Made with the catalogue whenever a
    /// calibration changes.
    std::vector<CatalogDrift> drifts(const std::string& session) const;

    const std::filesystem::path& folder() const { return folder_; }
    /// FOLDER/.darkbox, where the daemon keeps what is its own.
    std::filesystem::path own_folder() const { return folder_ / own_folder_name; }
    /// Whether the catalogue found on disk was damaged and has been made anew.
    bool was_damaged() const;

    static constexpr const char* own_folder_name = ".darkbox";

    struct State;
    State& state() const { return *state_; }  ///< for job_store.cpp

private:
    const std::filesystem::path folder_;
    const std::unique_ptr<State> state_;
};

}  // namespace darkbox
