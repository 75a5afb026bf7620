#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "rig/daemon/catalog.h"

namespace darkbox {

/// The open database behind a Catalog. Everything in it is guarded by `mutex`.
struct Catalog::State {
    std::mutex mutex;
    std::filesystem::path file;  ///< for messages; ":memory:"
    std::unique_ptr<SQLite::Database> database;
    bool was_damaged = false;
    std::string folder_stamp = {};  ///< of the folder at the last refresh()
    /// Folders that may become or finish a session without the folder above them changing, with their stamps.
    std::map<std::string, std::string> unsettled = {};
};

/// The version of the tables that this program writes; PRAGMA user_version in the file.
inline constexpr int catalog_version = 4;

/// Sets the connection up for a daemon that may be killed, and brings older tables up to catalog_version, one
/// transaction a version. Throws InputError for a newer file.
void prepare_database(SQLite::Database& database, const std::string& file);

/// Opens the file; one that SQLite calls damaged is moved aside to NAME.damaged and made anew.
std::unique_ptr<SQLite::Database> open_database(const std::filesystem::path& file, bool& was_damaged);

[[noreturn]] void throw_database_error(const std::filesystem::path& file, const SQLite::Exception& error);

/// Runs `work` with the state's lock held; SQLite's errors come out as DeviceError that names the file.
template <typename Work>
auto with_database(Catalog::State& state, Work work) {
    const std::scoped_lock lock(state.mutex);
    try {
        return work(*state.database);
    } catch (const SQLite::Exception& error) {
        throw_database_error(state.file, error);
    }
}

}  // namespace darkbox
