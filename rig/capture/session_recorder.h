#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <variant>

#include "acquisition/session/session_writer.h"
#include "rig/capture/frame_sink.h"

namespace darkbox {

struct RecorderLimits {
    std::size_t queued_bytes = std::size_t{256} << 20;  ///< of frames that wait for the disk; at least one frame may
    std::chrono::milliseconds patience{10'000};         ///< how long add() waits for room before the capture fails
};

/// Writes a session while the capture goes on: a thread of its own takes frames from a bounded queue. Nothing is ever
/// dropped: a disk that does not keep up, or that fails, fails the capture, and what was acknowledged before stays.
/// Thread-compatible: one thread calls it; the writer is the recorder's alone until finish().
class SessionRecorder final : public FrameSink {
public:
    explicit SessionRecorder(SessionWriter& writer, RecorderLimits limits = {});
    SessionRecorder(const SessionRecorder&) = delete;
    SessionRecorder& operator=(const SessionRecorder&) = delete;
    /// Writes what is queued, as far as it can be written.
    ~SessionRecorder() override;

    const std::vector<FrameRecord>& kept() const override { return kept_; }
    Frame read(const FrameRecord& record) const override;
    void add(Frame frame, FrameRecord record) override;
    void withdraw(const std::string& file, const std::string& why) override;
    void note_event(const std::string& what) override;
    bool has_room() const override;

    /// Waits until all is written and gives the writer back. Throws what kept a frame from being written.
    void finish();
    /// The most bytes that ever waited.
    std::size_t most_queued() const;

private:
    struct Picture {
        Frame frame;
        FrameRecord record;
    };
    struct Withdrawal {
        std::string file, why;
    };
    using Entry = std::variant<Picture, Withdrawal, std::string>;

    static std::size_t bytes_of(const Entry& entry);
    bool fits(std::size_t bytes) const { return queued_ == 0 || queued_ + bytes <= limits_.queued_bytes; }
    void write(std::stop_token stop);
    void write_one(Entry entry);
    void push(std::unique_lock<std::mutex>& lock, Entry entry);
    void rethrow_failure() const;

    SessionWriter& writer_;
    const RecorderLimits limits_;
    const std::vector<FrameRecord> kept_;

    mutable std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<Entry> entries_;    // guarded by mutex_
    std::size_t queued_ = 0;       // guarded by mutex_; bytes, those being written included
    std::size_t most_queued_ = 0;  // guarded by mutex_
    std::exception_ptr failure_;   // guarded by mutex_
    std::jthread thread_;          // last: ends before what it uses
};

}  // namespace darkbox
