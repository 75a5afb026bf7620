#include "rig/daemon/job_store.h"

#include <charconv>
#include <limits>

#include "rig/daemon/catalog_database.h"

namespace darkbox {
namespace {

using Json = nlohmann::json;
using SQLite::Statement;

std::string text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string outcome_text(const Job& job) {
    return text({{"folder", job.outcome.session.string()},
                 {"frames", job.outcome.frames},
                 {"resumed", job.outcome.resumed},
                 {"repeated", job.outcome.repeated},
                 {"most_queued_bytes", job.outcome.most_queued},
                 {"seconds", job.outcome.duration.count()},
                 {"findings", job.outcome.findings},
                 {"result", job.result},
                 {"detail", job.failure.what},
                 {"hint", job.failure.hint},
                 {"done", job.progress.done},
                 {"total", job.progress.total},
                 {"stage", job.progress.stage},
                 {"next", job.next}});
}

void read_outcome(const std::string& outcome, Job& job) {
    const Json json = Json::parse(outcome, nullptr, false);
    if (!json.is_object()) return;
    job.outcome = {.session = json.value("folder", ""),
                   .frames = json.value("frames", std::size_t{0}),
                   .resumed = json.value("resumed", 0),
                   .repeated = json.value("repeated", 0),
                   .most_queued = json.value("most_queued_bytes", std::size_t{0}),
                   .duration = Seconds(json.value("seconds", 0.0)),
                   .findings = json.value("findings", std::vector<std::string>())};
    job.result = json.value("result", Json());
    job.failure = {.what = json.value("detail", ""), .hint = json.value("hint", "")};
    job.progress = {.stage = json.value("stage", ""),
                    .done = json.value("done", std::size_t{0}),
                    .total = json.value("total", std::size_t{0}),
                    .detail = ""};
    job.next = json.value("next", std::uint64_t{0});
}

constexpr const char* columns = "id, kind, state, session, orders, attempts, created, started, ended, outcome";

Job read_job(Statement& row) {
    Job job;
    job.id = static_cast<std::uint64_t>(row.getColumn(0).getInt64());
    job.kind = job_kind_from_name(row.getColumn(1).getString()).value_or(JobKind::capture);
    job.state = job_state_from_name(row.getColumn(2).getString()).value_or(JobState::failed);
    job.session = row.getColumn(3).getString();
    job.orders = Json::parse(row.getColumn(4).getString(), nullptr, false);
    if (!job.orders.is_object()) job.orders = Json::object();
    job.attempts = row.getColumn(5).getInt();
    job.created = row.getColumn(6).getString();
    job.started = row.getColumn(7).getString();
    job.ended = row.getColumn(8).getString();
    read_outcome(row.getColumn(9).getString(), job);
    return job;
}

std::vector<Job> read_jobs(Statement& statement) {
    std::vector<Job> jobs;
    while (statement.executeStep()) jobs.push_back(read_job(statement));
    return jobs;
}

void bind_job(Statement& statement, const Job& job) {
    statement.bind(1, std::string(name(job.kind)));
    statement.bind(2, std::string(name(job.state)));
    statement.bind(3, job.session);
    statement.bind(4, text(job.orders));
    statement.bind(5, job.attempts);
    statement.bind(6, job.created);
    statement.bind(7, job.started);
    statement.bind(8, job.ended);
    statement.bind(9, outcome_text(job));
}

std::uint64_t insert(SQLite::Database& database, const Job& job) {
    Statement statement(database,
                        "INSERT INTO jobs (kind, state, session, orders, attempts, created, started, ended, outcome) "
                        "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
    bind_job(statement, job);
    statement.exec();
    return static_cast<std::uint64_t>(database.getLastInsertRowid());
}

void update(SQLite::Database& database, const Job& job) {
    Statement statement(database,
                        "UPDATE jobs SET kind = ?, state = ?, session = ?, orders = ?, attempts = ?, created = ?, "
                        "started = ?, ended = ?, outcome = ? WHERE id = ?");
    bind_job(statement, job);
    statement.bind(10, static_cast<std::int64_t>(job.id));
    statement.exec();
}

std::int64_t id_before(const PageRequest& page) {
    std::int64_t id = std::numeric_limits<std::int64_t>::max();
    if (!page.after.empty()) std::from_chars(page.after.data(), page.after.data() + page.after.size(), id);
    return id;
}

}  // namespace

std::uint64_t JobStore::add(const Job& job) {
    return with_database(catalog_.state(), [&](SQLite::Database& database) { return insert(database, job); });
}

void JobStore::save(const Job& job) {
    with_database(catalog_.state(), [&](SQLite::Database& database) { update(database, job); });
}

std::uint64_t JobStore::save_with_next(Job& job, const Job& next) {
    return with_database(catalog_.state(), [&](SQLite::Database& database) {
        SQLite::Transaction transaction(database);
        job.next = insert(database, next);
        update(database, job);
        transaction.commit();
        return job.next;
    });
}

std::optional<Job> JobStore::find(std::uint64_t id) const {
    return with_database(catalog_.state(), [&](SQLite::Database& database) -> std::optional<Job> {
        Statement statement(database, std::string("SELECT ") + columns + " FROM jobs WHERE id = ?");
        statement.bind(1, static_cast<std::int64_t>(id));
        auto jobs = read_jobs(statement);
        if (jobs.empty()) return std::nullopt;
        return std::move(jobs.front());
    });
}

std::vector<Job> JobStore::list(const PageRequest& page) const {
    return with_database(catalog_.state(), [&](SQLite::Database& database) {
        Statement statement(database,
                            std::string("SELECT ") + columns + " FROM jobs WHERE id < ? ORDER BY id DESC LIMIT ?");
        statement.bind(1, id_before(page));
        statement.bind(2, static_cast<std::int64_t>(page.limit));
        return read_jobs(statement);
    });
}

std::vector<Job> JobStore::unfinished() const {
    return with_database(catalog_.state(), [&](SQLite::Database& database) {
        Statement statement(
            database, std::string("SELECT ") + columns + " FROM jobs WHERE state IN ('queued', 'running') ORDER BY id");
        return read_jobs(statement);
    });
}

std::vector<std::uint64_t> JobStore::prune(std::size_t kept) {
    return with_database(catalog_.state(), [&](SQLite::Database& database) {
        std::vector<std::uint64_t> removed;
        Statement statement(database,
                            "DELETE FROM jobs WHERE state NOT IN ('queued', 'running') AND id <= (SELECT id FROM jobs "
                            "WHERE state NOT IN ('queued', 'running') ORDER BY id DESC LIMIT 1 OFFSET ?) RETURNING id");
        statement.bind(1, static_cast<std::int64_t>(kept));
        while (statement.executeStep())
            removed.push_back(static_cast<std::uint64_t>(statement.getColumn(0).getInt64()));
        return removed;
    });
}

}  // namespace darkbox
