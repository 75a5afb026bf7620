#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "acquisition/frame/frame.h"
#include "acquisition/session/session.h"

namespace darkbox {

/// Why a frame may not be what its record says.
struct FrameDoubt {
    std::string file;   ///< as in FrameRecord::file
    std::string words;  ///< become its verification
};

/// Writes a session: append-only, atomic, resumable. A frame is acknowledged when add() returns: its file is flushed
/// and renamed into place and its journal line is flushed, so it survives SIGKILL and power loss.
/// One writer at a time holds a session (a lock file). Thread-compatible.
class SessionWriter {
public:
    /// Starts a new session in an empty or absent folder. Throws InputError when the folder holds something else,
    /// DeviceError when it cannot be written.
    static SessionWriter create(const std::filesystem::path& folder, const SessionInfo& info);

    /// Goes on with an interrupted session from its journal; half-written files are removed.
    /// Throws InputError when there is none, when it is sealed already, or when the journal does not fit the files.
    static SessionWriter resume(const std::filesystem::path& folder);

    SessionWriter(SessionWriter&&) noexcept;
    SessionWriter& operator=(SessionWriter&&) noexcept;
    ~SessionWriter();

    const std::filesystem::path& folder() const;
    const SessionInfo& info() const;
    /// In the order in which they were acknowledged.
    const std::vector<FrameRecord>& acknowledged() const;

    /// A frame off the sensor, kept without loss: as TIFF. Sizes, format, sequence, timestamp, controls and sha256 are
    /// filled in here from the frame; kind, lamp, lamp times and verification are the caller's. An empty `record.file`
    /// becomes "frames/NNNN_NAME.tif" from the count and the lamp's name or the kind.
    void add(const Frame& frame, FrameRecord record);
    /// A picture kept as its bytes; `record.file` names it ("frames/cat.00.png").
    void add(std::span<const std::byte> bytes, FrameRecord record);
    /// A frame of a sealed session, `file`, under the same record: linked where the disk allows it, else copied. Throws
    /// InputError when the file is not what the record's checksum says.
    void take_over(const std::filesystem::path& file, const FrameRecord& record);
    /// Gives an acknowledged frame up again: the session never had it, and may take another of that name. Throws
    /// InputError when it has none of that name.
    void withdraw(const std::string& file, const std::string& why);
    /// Any other payload: masks, given lights, rig.toml. `name` is relative to data/, without "..".
    void add_extra(const std::string& name, std::span<const std::byte> bytes);
    void note_event(const std::string& what);
    void add_note(const std::string& note);

    /// Writes session.json and the BagIt manifests, flushes, removes the journal. The session is read-only afterwards.
    /// `order`: names of frames in the order in which the manifest is to have them; others come after, as acknowledged.
    /// `doubts`: frames that are not verified after all. Throws InputError when fewer frames are there than planned.
    Session seal(const std::vector<std::string>& order = {}, const std::vector<FrameDoubt>& doubts = {});

private:
    struct State;
    explicit SessionWriter(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace darkbox
