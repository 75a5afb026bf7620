#include "rig/capture/session_recorder.h"

#include <fmt/format.h>

#include <algorithm>

#include "acquisition/device/device_error.h"
#include "acquisition/session/frame_file.h"

namespace darkbox {

SessionRecorder::SessionRecorder(SessionWriter& writer, RecorderLimits limits)
    : writer_(writer),
      limits_(limits),
      kept_(writer.acknowledged()),
      thread_([this](const std::stop_token& stop) { write(stop); }) {}

SessionRecorder::~SessionRecorder() = default;

Frame SessionRecorder::read(const FrameRecord& record) const {
    return read_frame(writer_.folder() / "data" / record.file, record);
}

std::size_t SessionRecorder::bytes_of(const Entry& entry) {
    const auto* picture = std::get_if<Picture>(&entry);
    return picture ? picture->frame.pixels.size() + picture->frame.jpeg.size() : 0;
}

void SessionRecorder::rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
}

void SessionRecorder::push(std::unique_lock<std::mutex>& lock, Entry entry) {
    const std::size_t bytes = bytes_of(entry);
    const bool room = changed_.wait_for(lock, limits_.patience, [&] { return failure_ || fits(bytes); });
    rethrow_failure();
    if (!room)
        throw DeviceError(fmt::format("the disk under {} does not keep up: {} MB of frames have waited for {:.1f} s",
                                      writer_.folder().string(), queued_ >> 20, Seconds(limits_.patience).count()),
                          "write to a faster disk, or stop what else writes to it; then resume the session");
    queued_ += bytes;
    most_queued_ = std::max(most_queued_, queued_);
    entries_.push_back(std::move(entry));
    changed_.notify_all();
}

void SessionRecorder::add(Frame frame, FrameRecord record) {
    std::unique_lock lock(mutex_);
    push(lock, Picture{std::move(frame), std::move(record)});
}

void SessionRecorder::withdraw(const std::string& file, const std::string& why) {
    const std::unique_lock lock(mutex_);
    entries_.emplace_back(Withdrawal{file, why});
    changed_.notify_all();
}

/// Notes that something went wrong must not hide what it was.
void SessionRecorder::note_event(const std::string& what) {
    const std::unique_lock lock(mutex_);
    entries_.emplace_back(what);
    changed_.notify_all();
}

bool SessionRecorder::has_room() const {
    const std::unique_lock lock(mutex_);
    return !failure_ && queued_ < limits_.queued_bytes;
}

void SessionRecorder::write(std::stop_token stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !entries_.empty(); }) || !entries_.empty()) {
        Entry entry = std::move(entries_.front());
        const std::size_t bytes = bytes_of(entry);
        entries_.pop_front();
        const bool failed = failure_ != nullptr;
        lock.unlock();
        std::exception_ptr failure;
        try {
            // After a failure later frames are not written: the journal must not have holes that nobody noticed.
            if (!failed) write_one(std::move(entry));
        } catch (...) {
            failure = std::current_exception();
        }
        lock.lock();
        queued_ -= bytes;
        if (failure) failure_ = failure;
        changed_.notify_all();
    }
}

void SessionRecorder::write_one(Entry entry) {
    if (auto* picture = std::get_if<Picture>(&entry))
        writer_.add(picture->frame, std::move(picture->record));
    else if (const auto* withdrawal = std::get_if<Withdrawal>(&entry))
        writer_.withdraw(withdrawal->file, withdrawal->why);
    else
        writer_.note_event(std::get<std::string>(entry));
}

void SessionRecorder::finish() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    const std::unique_lock lock(mutex_);
    rethrow_failure();
}

std::size_t SessionRecorder::most_queued() const {
    const std::unique_lock lock(mutex_);
    return most_queued_;
}

}  // namespace darkbox
