#include "rig/daemon/catalog.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "acquisition/device/device_error.h"
#include "acquisition/session/durable_file.h"
#include "rig/daemon/catalog_database.h"
#include "rig/daemon/catalog_drift.h"
#include "rig/daemon/catalog_scan.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using SQLite::Statement;

constexpr const char* session_columns =
    "name, state, object, created, frames, problem, retakes, inventory, dublin_core";

std::string lower_case(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return text;
}

/// Everything that a search looks through.
std::string words_of(const SessionListing& session) {
    std::string words = session.name + '\n' + session.object + '\n' + session.record.inventory;
    for (const auto& entry : session.record.dublin_core)
        for (const std::string& value : entry.second) words += '\n' + value;
    return lower_case(std::move(words));
}

/// What is asked for, word by word.
std::vector<std::string> wanted_words(const std::string& find) {
    std::istringstream text(lower_case(find));
    return {std::istream_iterator<std::string>(text), {}};
}

/// The condition that each of them occurs.
std::string having(const std::vector<std::string>& words) {
    std::string condition;
    for (std::size_t i = 0; i < words.size(); ++i) condition += " AND instr(words, ?) > 0";
    return condition;
}

SessionListing read_listing(Statement& row) {
    const auto dublin_core = nlohmann::json::parse(row.getColumn(8).getString()).get<DublinCore>();
    return {.name = row.getColumn(0).getString(),
            .state = session_state_from_name(row.getColumn(1).getString()),
            .object = row.getColumn(2).getString(),
            .record = {.inventory = row.getColumn(7).getString(), .dublin_core = dublin_core},
            .created = row.getColumn(3).getString(),
            .frames = static_cast<std::size_t>(row.getColumn(4).getInt64()),
            .problem = row.getColumn(5).getString(),
            .retakes = row.getColumn(6).getString()};
}

CatalogFrame read_frame_row(Statement& row) {
    return {.file = row.getColumn(0).getString(),
            .kind = row.getColumn(1).getString(),
            .lamp = row.getColumn(2).getString(),
            .format = row.getColumn(3).getString(),
            .width = row.getColumn(4).getInt(),
            .height = row.getColumn(5).getInt(),
            .exposure_s = row.getColumn(6).getDouble(),
            .gain = row.getColumn(7).getDouble(),
            .sequence = static_cast<std::uint64_t>(row.getColumn(8).getInt64()),
            .timestamp_ns = row.getColumn(9).getInt64(),
            .verified = row.getColumn(10).getInt() != 0,
            .sha256 = row.getColumn(11).getString()};
}

CatalogCalibration read_calibration_row(Statement& row) {
    return {.session = row.getColumn(0).getString(),
            .created = row.getColumn(1).getString(),
            .rig = row.getColumn(2).getString(),
            .lamps = static_cast<std::size_t>(row.getColumn(3).getInt64()),
            .used = static_cast<std::size_t>(row.getColumn(4).getInt64()),
            .condition_number = row.getColumn(5).getDouble(),
            .sigma_deg = row.getColumn(6).getDouble(),
            .intensities_known = row.getColumn(7).getInt() != 0,
            .warnings = static_cast<std::size_t>(row.getColumn(8).getInt64())};
}

CatalogDrift read_drift_row(Statement& row) {
    return {.session = row.getColumn(0).getString(),
            .against = row.getColumn(1).getString(),
            .role = row.getColumn(2).getString(),
            .steady = row.getColumn(3).getInt() != 0,
            .alarm = row.getColumn(4).getString(),
            .findings_json = row.getColumn(5).getString()};
}

template <typename... Values>
void bind_all(Statement& statement, const Values&... values) {
    int place = 0;
    (statement.bind(++place, values), ...);
}

template <typename Row, typename Read, typename... Values>
std::vector<Row> rows_of(SQLite::Database& database, const std::string& query, Read read, const Values&... values) {
    Statement statement(database, query);
    bind_all(statement, values...);
    std::vector<Row> rows;
    while (statement.executeStep()) rows.push_back(read(statement));
    return rows;
}

std::int64_t whole(std::size_t value) { return static_cast<std::int64_t>(value); }

void forget(SQLite::Database& database, const std::string& session) {
    Statement statement(database, "DELETE FROM sessions WHERE name = ?");
    statement.bind(1, session);
    statement.exec();
}

void insert_frames(SQLite::Database& database, const ScannedSession& scanned) {
    Statement insert(database, "INSERT INTO frames VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    for (std::size_t i = 0; i < scanned.frames.size(); ++i) {
        const CatalogFrame& f = scanned.frames[i];
        bind_all(insert, scanned.listing.name, whole(i), f.file, f.kind, f.lamp, f.format, f.width, f.height,
                 f.exposure_s, f.gain, static_cast<std::int64_t>(f.sequence), f.timestamp_ns, f.verified ? 1 : 0,
                 f.sha256);
        insert.exec();
        insert.reset();
    }
}

void put_calibration(SQLite::Database& database, const CatalogCalibration& c) {
    Statement insert(database, "INSERT INTO calibrations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
    bind_all(insert, c.session, c.created, c.rig, whole(c.lamps), whole(c.used), c.condition_number, c.sigma_deg,
             c.intensities_known ? 1 : 0, whole(c.warnings));
    insert.exec();
}

void insert_session(SQLite::Database& database, const ScannedSession& scanned, const std::string& stamp) {
    const SessionListing& s = scanned.listing;
    Statement insert(database, "INSERT INTO sessions VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
    bind_all(insert, s.name, name(s.state), s.object, s.created, whole(s.frames), s.problem, stamp, s.retakes,
             s.record.inventory, nlohmann::json(s.record.dublin_core).dump(), words_of(s));
    insert.exec();
    insert_frames(database, scanned);
    if (scanned.calibration) put_calibration(database, *scanned.calibration);
}

using Earliest = std::map<std::string, std::string>;  ///< by rig: when the earliest calibration that changed was made

void note_earliest(Earliest& earliest, const std::string& rig, const std::string& created) {
    const auto [place, fresh] = earliest.try_emplace(rig, created);
    if (!fresh) place->second = std::min(place->second, created);
}

/// The calibration that is about to be forgotten or was just read.
void note_change(SQLite::Database& database, const std::string& session, Earliest& earliest) {
    const auto rows = rows_of<CatalogCalibration>(database, "SELECT * FROM calibrations WHERE session = ?",
                                                  read_calibration_row, session);
    for (const CatalogCalibration& row : rows) note_earliest(earliest, row.rig, row.created);
}

void put_drift(SQLite::Database& database, const CatalogDrift& drift) {
    Statement insert(database, "INSERT OR REPLACE INTO drift VALUES (?, ?, ?, ?, ?, ?)");
    bind_all(insert, drift.session, drift.against, drift.role, drift.steady ? 1 : 0, drift.alarm, drift.findings_json);
    insert.exec();
}

/// Compares again every calibration that has a changed one before it or is one.
void compare_again(SQLite::Database& database, const fs::path& folder, const Earliest& earliest) {
    for (const auto& [rig, created] : earliest) {
        const auto all = rows_of<CatalogCalibration>(
            database, "SELECT * FROM calibrations WHERE rig = ? ORDER BY created, session", read_calibration_row, rig);
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (all[i].created < created) continue;
            rows_of<int>(database, "DELETE FROM drift WHERE session = ?", [](Statement&) { return 0; }, all[i].session);
            if (i == 0) continue;
            put_drift(database, compare_calibrations(folder, all[i - 1].session, all[i].session, "last"));
            put_drift(database, compare_calibrations(folder, all[0].session, all[i].session, "first"));
        }
    }
}

/// Takes the stamp first: what changes while it is read is read again the next time.
void read_again(SQLite::Database& database, const fs::path& folder, const std::string& session) {
    const std::string stamp = session_stamp(folder / session);
    const auto scanned = scan_session(folder / session);
    SQLite::Transaction transaction(database);
    Earliest changed;
    note_change(database, session, changed);
    forget(database, session);
    if (scanned) insert_session(database, *scanned, stamp);
    note_change(database, session, changed);
    compare_again(database, folder, changed);
    transaction.commit();
}

std::map<std::string, std::string> known_stamps(SQLite::Database& database) {
    std::map<std::string, std::string> stamps;
    Statement statement(database, "SELECT name, stamp FROM sessions");
    while (statement.executeStep())
        stamps.emplace(statement.getColumn(0).getString(), statement.getColumn(1).getString());
    return stamps;
}

/// Changes in groups: a transaction each would cost a flush each.
class Batches {
public:
    explicit Batches(SQLite::Database& database) : database_(database) {}

    template <typename Change>
    void apply(const Change& change) {
        if (!transaction_) transaction_.emplace(database_);
        change();
        if (++changes_ % at_once == 0) commit();
    }
    void commit() {
        if (transaction_) transaction_->commit();
        transaction_.reset();
    }

private:
    static constexpr int at_once = 256;
    SQLite::Database& database_;
    std::optional<SQLite::Transaction> transaction_;
    int changes_ = 0;
};

/// Returns the sessions that are not settled.
std::map<std::string, std::string> refresh_all(SQLite::Database& database, const fs::path& folder) {
    std::map<std::string, std::string> unsettled;
    auto known = known_stamps(database);
    Batches batches(database);
    Earliest changed;
    const auto replace = [&](const std::string& session, const std::optional<ScannedSession>& scanned,
                             const std::string& stamp) {
        note_change(database, session, changed);
        forget(database, session);
        if (scanned) insert_session(database, *scanned, stamp);
        note_change(database, session, changed);
    };
    for (const std::string& session : session_names(folder)) {
        const std::string stamp = session_stamp(folder / session);
        if (stamp.empty() || stamp.starts_with('-')) unsettled.emplace(session, stamp);
        const auto old = known.find(session);
        const bool same = old != known.end() && old->second == stamp;
        if (old != known.end() && !stamp.empty()) known.erase(old);
        if (same || stamp.empty()) continue;
        const auto scanned = scan_session(folder / session);
        batches.apply([&] { replace(session, scanned, stamp); });
    }
    for (const auto& gone : known) batches.apply([&] { replace(gone.first, std::nullopt, ""); });
    batches.apply([&] { compare_again(database, folder, changed); });
    batches.commit();
    return unsettled;
}

std::unique_ptr<Catalog::State> open_state(const fs::path& folder, Catalog::Place place) {
    auto state = std::make_unique<Catalog::State>();
    if (place == Catalog::Place::in_memory) {
        state->file = ":memory:";
        state->database = std::make_unique<SQLite::Database>(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
        prepare_database(*state->database, ":memory:");
        return state;
    }
    make_folder_durably(folder / Catalog::own_folder_name);
    state->file = folder / Catalog::own_folder_name / "catalog.sqlite";
    state->database = open_database(state->file, state->was_damaged);
    return state;
}

}  // namespace

Catalog::Catalog(fs::path folder, Place place) : folder_(std::move(folder)), state_(open_state(folder_, place)) {}
Catalog::~Catalog() = default;

bool Catalog::was_damaged() const { return state_->was_damaged; }

void Catalog::refresh() {
    with_database(*state_, [&](SQLite::Database& database) {
        const std::string stamp = folder_stamp(folder_);
        state_->unsettled = refresh_all(database, folder_);
        state_->folder_stamp = stamp;
    });
}

void Catalog::refresh(const std::string& session) {
    (void)session_path(folder_, session);  // refuses what is no name
    with_database(*state_, [&](SQLite::Database& database) { read_again(database, folder_, session); });
}

void Catalog::refresh_if_changed() {
    const std::string stamp = folder_stamp(folder_);
    const bool changed = with_database(*state_, [&](SQLite::Database& database) {
        if (stamp != state_->folder_stamp) return true;
        for (auto& [session, old] : state_->unsettled) {
            std::string now = session_stamp(folder_ / session);
            if (now == old) continue;
            read_again(database, folder_, session);
            old = std::move(now);
        }
        return false;
    });
    if (changed) refresh();
}

void Catalog::rebuild() {
    with_database(*state_, [&](SQLite::Database& database) {
        database.exec("DELETE FROM sessions");
        database.exec("PRAGMA wal_checkpoint(TRUNCATE)");
        state_->unsettled = refresh_all(database, folder_);
    });
}

std::vector<SessionListing> Catalog::sessions(const PageRequest& page, const std::string& find) const {
    const std::vector<std::string> words = wanted_words(find);
    return with_database(*state_, [&](SQLite::Database& database) {
        Statement statement(database, fmt::format("SELECT {} FROM sessions WHERE name > ?{} ORDER BY name LIMIT ?",
                                                  session_columns, having(words)));
        int place = 0;
        statement.bind(++place, page.after);
        for (const std::string& word : words) statement.bind(++place, word);
        statement.bind(++place, whole(page.limit));
        std::vector<SessionListing> rows;
        while (statement.executeStep()) rows.push_back(read_listing(statement));
        return rows;
    });
}

std::optional<SessionListing> Catalog::session(const std::string& name) const {
    return with_database(*state_, [&](SQLite::Database& database) -> std::optional<SessionListing> {
        auto rows = rows_of<SessionListing>(
            database, fmt::format("SELECT {} FROM sessions WHERE name = ?", session_columns), read_listing, name);
        if (rows.empty()) return std::nullopt;
        return std::move(rows.front());
    });
}

std::size_t Catalog::session_count(const std::string& find) const {
    const std::vector<std::string> words = wanted_words(find);
    return with_database(*state_, [&](SQLite::Database& database) {
        Statement statement(database, "SELECT count(*) FROM sessions WHERE 1" + having(words));
        int place = 0;
        for (const std::string& word : words) statement.bind(++place, word);
        statement.executeStep();
        return static_cast<std::size_t>(statement.getColumn(0).getInt64());
    });
}

std::vector<CatalogFrame> Catalog::frames(const std::string& session) const {
    return with_database(*state_, [&](SQLite::Database& database) {
        return rows_of<CatalogFrame>(database,
                                     "SELECT file, kind, lamp, format, width, height, exposure_s, gain, sequence, "
                                     "timestamp_ns, verified, sha256 FROM frames WHERE session = ? ORDER BY place",
                                     read_frame_row, session);
    });
}

std::vector<CatalogCalibration> Catalog::calibrations(const PageRequest& page) const {
    // Ordered by time, continued after a session: its time first, then its name.
    return with_database(*state_, [&](SQLite::Database& database) {
        return rows_of<CatalogCalibration>(
            database,
            "SELECT * FROM calibrations WHERE ?1 = '' OR (created, session) > "
            "(coalesce((SELECT created FROM calibrations WHERE session = ?1), ''), ?1) ORDER BY created, session "
            "LIMIT ?2",
            read_calibration_row, page.after, whole(page.limit));
    });
}

std::vector<CatalogDrift> Catalog::drifts(const std::string& session) const {
    return with_database(*state_, [&](SQLite::Database& database) {
        return rows_of<CatalogDrift>(database, "SELECT * FROM drift WHERE session = ? ORDER BY role", read_drift_row,
                                     session);
    });
}

}  // namespace darkbox
