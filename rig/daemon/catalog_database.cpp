#include "rig/daemon/catalog_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <array>

#include "acquisition/device/device_error.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// What each version adds to the one before.
constexpr std::array migrations{
    R"sql(
CREATE TABLE sessions (
    name TEXT PRIMARY KEY, state TEXT NOT NULL, object TEXT NOT NULL, created TEXT NOT NULL, frames INTEGER NOT NULL,
    problem TEXT NOT NULL, stamp TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE frames (
    session TEXT NOT NULL REFERENCES sessions(name) ON DELETE CASCADE, place INTEGER NOT NULL, file TEXT NOT NULL,
    kind TEXT NOT NULL, lamp TEXT NOT NULL, format TEXT NOT NULL, width INTEGER NOT NULL, height INTEGER NOT NULL,
    exposure_s REAL NOT NULL, gain REAL NOT NULL, sequence INTEGER NOT NULL, timestamp_ns INTEGER NOT NULL,
    verified INTEGER NOT NULL, sha256 TEXT NOT NULL, PRIMARY KEY (session, place)
) WITHOUT ROWID;
CREATE TABLE calibrations (
    session TEXT PRIMARY KEY REFERENCES sessions(name) ON DELETE CASCADE, created TEXT NOT NULL, rig TEXT NOT NULL,
    lamps INTEGER NOT NULL, used INTEGER NOT NULL, condition_number REAL NOT NULL, sigma_deg REAL NOT NULL,
    intensities_known INTEGER NOT NULL, warnings INTEGER NOT NULL
) WITHOUT ROWID;
CREATE INDEX calibrations_by_rig ON calibrations (rig, created);
CREATE TABLE jobs (
    id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL, session TEXT NOT NULL,
    orders TEXT NOT NULL, attempts INTEGER NOT NULL, created TEXT NOT NULL, started TEXT NOT NULL, ended TEXT NOT NULL,
    outcome TEXT NOT NULL
);
CREATE INDEX jobs_by_state ON jobs (state, id);
)sql",
    R"sql(
CREATE TABLE drift (
    session TEXT NOT NULL REFERENCES calibrations(session) ON DELETE CASCADE, against TEXT NOT NULL,
    role TEXT NOT NULL, steady INTEGER NOT NULL, alarm TEXT NOT NULL, findings TEXT NOT NULL,
    PRIMARY KEY (session, role)
) WITHOUT ROWID;
)sql",
    R"sql(
DELETE FROM sessions;
ALTER TABLE sessions ADD COLUMN retakes TEXT NOT NULL DEFAULT '';
)sql",
    // Every session is read again for them.
    R"sql(
ALTER TABLE sessions ADD COLUMN inventory TEXT NOT NULL DEFAULT '';
ALTER TABLE sessions ADD COLUMN dublin_core TEXT NOT NULL DEFAULT '{}';
ALTER TABLE sessions ADD COLUMN words TEXT NOT NULL DEFAULT '';
UPDATE sessions SET stamp = '';
)sql"};
static_assert(migrations.size() == catalog_version);

void migrate(SQLite::Database& database, const std::string& file) {
    const int found = database.execAndGet("PRAGMA user_version").getInt();
    if (found > catalog_version)
        throw InputError(
            fmt::format("{} is of a newer darkbox (version {}, this one knows {})", file, found, catalog_version),
            "upgrade darkbox, or remove the file: darkbox sessions --rebuild makes it again");
    for (int version = found; version < catalog_version; ++version) {
        SQLite::Transaction transaction(database);
        database.exec(migrations[static_cast<std::size_t>(version)]);
        database.exec(fmt::format("PRAGMA user_version = {}", version + 1));
        transaction.commit();
    }
}

bool means_damage(const SQLite::Exception& error) {
    return error.getErrorCode() == SQLITE_CORRUPT || error.getErrorCode() == SQLITE_NOTADB;
}

std::unique_ptr<SQLite::Database> open_checked(const fs::path& file) {
    auto database = std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    prepare_database(*database, file.string());
    const std::string verdict = database->execAndGet("PRAGMA quick_check(1)").getString();
    if (verdict != "ok") throw SQLite::Exception(verdict, SQLITE_CORRUPT);
    return database;
}

void move_aside(const fs::path& file) {
    for (const char* suffix : {"", "-wal", "-shm"}) {
        std::error_code ignored;  // what is still in the way then, the next opening tells
        fs::rename(file.string() + suffix, file.string() + ".damaged" + suffix, ignored);
    }
}

}  // namespace

void throw_database_error(const fs::path& file, const SQLite::Exception& error) {
    const bool full = error.getErrorCode() == SQLITE_FULL;
    throw DeviceError(fmt::format("catalogue {}: {}", file.string(), error.what()),
                      full ? "free space on its disk"
                           : "see whether its disk is full or read-only; darkbox sessions --rebuild makes it again");
}

void prepare_database(SQLite::Database& database, const std::string& file) {
    database.setBusyTimeout(5000);
    // A write-ahead log that is flushed at every commit: SIGKILL and power loss leave whole transactions.
    database.exec("PRAGMA journal_mode = WAL");
    database.exec("PRAGMA synchronous = FULL");
    database.exec("PRAGMA foreign_keys = ON");
    migrate(database, file);
}

std::unique_ptr<SQLite::Database> open_database(const fs::path& file, bool& was_damaged) {
    try {
        try {
            return open_checked(file);
        } catch (const SQLite::Exception& error) {
            if (!means_damage(error)) throw;
        }
        move_aside(file);
        was_damaged = true;
        return open_checked(file);
    } catch (const SQLite::Exception& error) {
        throw_database_error(file, error);
    }
}

}  // namespace darkbox
