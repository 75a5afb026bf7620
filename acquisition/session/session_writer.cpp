#include "acquisition/session/session_writer.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "acquisition/device/device_error.h"
#include "acquisition/session/bag.h"
#include "acquisition/session/durable_file.h"
#include "acquisition/session/frame_file.h"
#include "acquisition/session/journal.h"
#include "acquisition/session/record_checks.h"
#include "acquisition/session/session_lock.h"
#include "acquisition/session/sha256.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

/// Of a create() that was killed.
bool is_leftover(const fs::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name == lock_name || name == partial_name ||
           (name == "data" && entry.is_directory() && files_below(entry.path()).empty());
}

/// Absent, empty, or holding no more than a create() that was killed leaves behind.
bool is_fresh(const fs::path& folder) {
    std::error_code ignored;
    if (!fs::exists(fs::status(folder, ignored))) return true;
    if (!fs::is_directory(folder, ignored)) return false;
    try {
        return std::all_of(fs::directory_iterator(folder), fs::directory_iterator(), is_leftover);
    } catch (const fs::filesystem_error& error) {
        throw_errno("read folder", folder.string(), error.code().value());
    }
}

void require_fresh(const fs::path& folder) {
    if (is_fresh(folder)) return;
    std::error_code ignored;
    const bool interrupted = fs::exists(folder / journal_name, ignored);
    throw InputError(fmt::format("{} is not an empty folder", folder.string()),
                     interrupted ? fmt::format("it holds an interrupted session; go on with it: darkbox capture "
                                               "--resume {}",
                                               folder.string())
                                 : "name a new folder");
}

/// What a killed writer was busy with was never acknowledged.
void remove_unacknowledged(const fs::path& folder, const SessionContents& contents) {
    ::unlink((folder / partial_name).c_str());
    for (const std::string& file : files_below(folder / "data")) {
        const fs::path path = folder / "data" / file;
        if (!contents.holds(file) && ::unlink(path.c_str()) != 0) throw_errno("unlink", path.string(), errno);
    }
}

void require_intact(const fs::path& folder, const Payload& payload) {
    const fs::path file = plain_file_inside(folder / "data", payload.name);
    const auto refuse = [&](const char* what) {
        throw InputError(
            fmt::format("{} {}, though its frame was acknowledged", file.string(), what),
            "the disk or another program damaged it: restore the file, or capture again into a new folder");
    };
    if (!fs::exists(file)) refuse("is missing");
    if (fs::file_size(file) != payload.size) refuse("has the wrong size");
    if (sha256_of_file(file) != payload.sha256) refuse("does not match its checksum");
}

void put_in_order(std::vector<FrameRecord>& frames, const std::vector<std::string>& order) {
    std::unordered_map<std::string, std::size_t> places;
    for (const std::string& name : order) places.emplace(name, places.size());
    const auto place = [&](const FrameRecord& record) {
        const auto found = places.find(record.file);
        return found == places.end() ? order.size() : found->second;
    };
    std::ranges::stable_sort(frames, {}, place);
}

void put_in_doubt(std::vector<FrameRecord>& frames, const std::vector<FrameDoubt>& doubts) {
    for (const FrameDoubt& doubt : doubts)
        for (FrameRecord& record : frames)
            if (record.file == doubt.file) {
                record.verified = false;
                record.verification = doubt.words;
            }
}

/// Housekeeping after the seal, all of it optional: the bag is complete without.
void tidy_sealed(const fs::path& folder) {
    for (const std::string& file : files_below(folder / "data")) {
        const fs::path path = folder / "data" / file;
        std::error_code ignored;
        fs::permissions(path, fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write,
                        fs::perm_options::remove | fs::perm_options::nofollow, ignored);
    }
    ::unlink((folder / journal_name).c_str());
    ::unlink((folder / lock_name).c_str());
}

/// "frames/0003_lamp-04.tif"
std::string frame_name(std::size_t number, const FrameRecord& record, PixelFormat format) {
    constexpr std::size_t longest = 64;
    std::string label = record.lamp_name.empty() ? std::string(name(record.kind)) : record.lamp_name;
    label.resize(std::min(label.size(), longest));
    const auto is_plain = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    };
    std::replace_if(label.begin(), label.end(), [&](char c) { return !is_plain(c); }, '-');
    return fmt::format("frames/{:04}_{}.{}", number, label, frame_extension(format));
}

FrameRecord record_of(const Frame& frame, FrameRecord record) {
    record.format = name(frame.format);
    record.width = frame.width;
    record.height = frame.height;
    record.bit_depth = frame.bit_depth;
    record.black_level = frame.black_level;
    record.exposure_s = frame.controls.exposure.count();
    record.gain = frame.controls.gain;
    record.sequence = frame.sequence;
    record.timestamp_ns = frame.timestamp.time_since_epoch().count();
    return record;
}

}  // namespace

struct SessionWriter::State {
    fs::path folder;
    UniqueFd lock;
    Journal journal;
    SessionContents contents;
    bool sealed = false;

    void require_open() const {
        if (sealed) throw std::logic_error("a sealed session takes nothing more");
    }

    /// File first, journal line second: a line never speaks of a file that is not safe on disk.
    void add_payload(const std::string& name, std::span<const std::byte> bytes, const JournalEntry& entry) {
        if (contents.holds(name))
            throw InputError(fmt::format("{} holds {} already", folder.string(), shown(name)),
                             "nothing in a session is ever replaced; give the file another name");
        const fs::path file = folder / "data" / name;
        make_folder_durably(file.parent_path());
        write_durably(file, bytes);
        acknowledge(entry);
    }

    void acknowledge(const JournalEntry& entry) {
        require_open();
        journal.append(entry);
        contents.apply(entry);
    }
};

SessionWriter::SessionWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;
SessionWriter& SessionWriter::operator=(SessionWriter&&) noexcept = default;
SessionWriter::~SessionWriter() = default;

SessionWriter SessionWriter::create(const fs::path& folder, const SessionInfo& info) {
    require_valid(folder.string(), info);
    require_fresh(folder);
    make_folder_durably(folder);
    UniqueFd lock = lock_session(folder);
    require_fresh(folder);  // another writer may have been faster to the lock, and gone again
    make_folder_durably(folder / "data" / "frames");
    Journal journal = Journal::create(folder, info);
    SessionContents contents;
    contents.info = info;
    return SessionWriter(
        std::make_unique<State>(State{folder, std::move(lock), std::move(journal), std::move(contents)}));
}

SessionWriter SessionWriter::resume(const fs::path& folder) {
    if (is_sealed(folder)) {
        tidy_sealed(folder);
        throw InputError(fmt::format("the session {} is sealed already", folder.string()),
                         "nothing is left to capture; process it, or start a new session");
    }
    std::error_code ignored;
    if (!fs::exists(folder / journal_name, ignored))
        throw InputError(fmt::format("{} holds no interrupted session", folder.string()),
                         "name the folder that darkbox capture was writing");
    UniqueFd lock = lock_session(folder);
    Journal::Replay replay = Journal::open(folder);
    for (const Payload& payload : replay.contents.payloads) require_intact(folder, payload);
    make_folder_durably(folder / "data" / "frames");
    remove_unacknowledged(folder, replay.contents);
    return SessionWriter(
        std::make_unique<State>(State{folder, std::move(lock), std::move(replay.journal), std::move(replay.contents)}));
}

const fs::path& SessionWriter::folder() const { return state_->folder; }
const SessionInfo& SessionWriter::info() const { return state_->contents.info; }
const std::vector<FrameRecord>& SessionWriter::acknowledged() const { return state_->contents.frames; }

void SessionWriter::add(const Frame& frame, FrameRecord record) {
    if (frame.status != FrameStatus::good)
        throw InputError(fmt::format("frame {} of the camera is damaged", frame.sequence), "take it again");
    if (record.file.empty()) record.file = frame_name(state_->contents.frames.size(), record, frame.format);
    add(encode_frame(frame), record_of(frame, std::move(record)));
}

void SessionWriter::add(std::span<const std::byte> bytes, FrameRecord record) {
    state_->require_open();
    require_valid(state_->folder.string(), record);
    record.sha256 = sha256_hex(bytes);
    const std::string file = record.file;
    state_->add_payload(file, bytes, FrameEntry{std::move(record), bytes.size()});
}

void SessionWriter::take_over(const fs::path& file, const FrameRecord& record) {
    state_->require_open();
    require_valid(state_->folder.string(), record);
    require_sha256(file.string(), record.sha256);
    if (sha256_of_file(file) != record.sha256)
        throw InputError(fmt::format("{} does not match its checksum", file.string()),
                         "the session that it is taken from is damaged: darkbox verify tells more");
    if (state_->contents.holds(record.file))
        throw InputError(fmt::format("{} holds {} already", state_->folder.string(), shown(record.file)),
                         "nothing in a session is ever replaced");
    const fs::path target = state_->folder / "data" / record.file;
    make_folder_durably(target.parent_path());
    link_or_copy_durably(file, target);
    state_->acknowledge(FrameEntry{record, fs::file_size(target)});
}

/// The journal first: a file that it does not know is removed by whoever goes on.
void SessionWriter::withdraw(const std::string& file, const std::string& why) {
    const auto is_this = [&](const FrameRecord& record) { return record.file == file; };
    if (std::ranges::none_of(state_->contents.frames, is_this))
        throw InputError(fmt::format("{} has no frame {}", state_->folder.string(), shown(file)),
                         "withdraw frames that were acknowledged");
    state_->acknowledge(WithdrawnEntry{file, why});
    const fs::path path = state_->folder / "data" / file;
    if (::unlink(path.c_str()) != 0) throw_errno("unlink", path.string(), errno);
}

void SessionWriter::add_extra(const std::string& name, std::span<const std::byte> bytes) {
    state_->require_open();
    require_payload_name(state_->folder.string(), name);
    state_->add_payload(name, bytes, Payload{name, bytes.size(), sha256_hex(bytes)});
}

void SessionWriter::note_event(const std::string& what) { state_->acknowledge(SessionEvent{iso8601_now(), what}); }
void SessionWriter::add_note(const std::string& note) { state_->acknowledge(NoteEntry{note}); }

Session SessionWriter::seal(const std::vector<std::string>& order, const std::vector<FrameDoubt>& doubts) {
    state_->require_open();
    const SessionContents& contents = state_->contents;
    const fs::path& folder = state_->folder;
    if (std::cmp_less(contents.frames.size(), contents.info.planned_shots))
        throw InputError(fmt::format("{}: {} frames of {} planned", folder.string(), contents.frames.size(),
                                     contents.info.planned_shots),
                         fmt::format("take the missing ones: darkbox capture --resume {}", folder.string()));
    remove_unacknowledged(folder, contents);
    put_in_order(state_->contents.frames, order);
    put_in_doubt(state_->contents.frames, doubts);
    try {
        write_bag(folder, contents);
    } catch (...) {
        state_->sealed = is_sealed(folder);  // whoever opens the folder would not see what is added from here on
        throw;
    }
    state_->sealed = true;
    tidy_sealed(folder);
    state_->lock.reset();
    return Session::open(folder);
}

}  // namespace darkbox
