#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/frame/ids.h"
#include "acquisition/session/object_record.h"

namespace darkbox {

enum class FrameKind { lit, dark, ambient, flat, ball };

/// How samples map to radiance.
enum class TransferCurve { linear, srgb };

/// The names used in session.json, and back; no value for a name that is not one.
std::string_view name(FrameKind kind);
std::string_view name(TransferCurve curve);
std::optional<FrameKind> frame_kind_from_name(std::string_view name);
std::optional<TransferCurve> transfer_curve_from_name(std::string_view name);

/// The time of day in UTC to the millisecond: "2026-01-31T23:59:59.999Z".
std::string iso8601_now();

/// What a sensor's noise came to: variance = floor + slope · signal, in squared sample units; signal is above the frame
/// without a lamp.
struct SensorNoise {
    double floor = 0.0;
    double slope = 0.0;

    friend bool operator==(const SensorNoise&, const SensorNoise&) = default;
};

/// Another session, by its name and by what it holds.
struct SessionReference {
    std::string name;             ///< of its folder
    std::string manifest_sha256;  ///< of its payload manifest, so of every byte in it

    friend bool operator==(const SessionReference&, const SessionReference&) = default;
};

/// One frame as the manifest (session.json) describes it. Times are nanoseconds on the capture's clock; imported
/// pictures have none.
struct FrameRecord {
    std::string file;  ///< under data/, for example "frames/0003_lamp-04.tif"
    FrameKind kind = FrameKind::lit;
    std::string format;  ///< PixelFormat name for captured frames; "png", "tiff", "jpeg", "exr" for imported bytes
    int width = 0;       ///< pixels
    int height = 0;
    int bit_depth = 16;        ///< significant bits; 32 for float
    double black_level = 0.0;  ///< sample units
    TransferCurve transfer = TransferCurve::linear;
    std::optional<LampId> lamp;  ///< none for dark and ambient frames
    std::string lamp_name;       ///< or the imported picture's own basename
    double exposure_s = 0.0;
    double gain = 1.0;
    std::uint64_t sequence = 0;
    std::int64_t timestamp_ns = 0;
    std::int64_t lamp_on_ns = 0;
    std::int64_t lamp_off_ns = 0;
    bool verified = false;
    std::string verification;               ///< what was checked and found, in words
    std::string sha256;                     ///< of the file, lower-case hex; filled by SessionWriter
    std::optional<SensorNoise> noise = {};  ///< of captured frames, where it was measured
    std::string taken_over_from = {};       ///< the session that it was captured in; empty: this one

    friend bool operator==(const FrameRecord&, const FrameRecord&) = default;
};

/// Something worth knowing that happened during a capture.
struct SessionEvent {
    std::string when;  ///< ISO 8601, UTC
    std::string what;
};

/// Where a lamp is meant to stand: rig frame (x right, y up, z to the camera, origin at the object), mm.
struct NominalLamp {
    std::string name;  ///< as in FrameRecord::lamp_name
    std::array<double, 3> position_mm{};

    friend bool operator==(const NominalLamp&, const NominalLamp&) = default;
};

/// What is known of the capture's geometry, for calibration. Each part may be missing.
struct CaptureGeometry {
    std::optional<double> mm_per_pixel;                 ///< in the plane of the object
    std::optional<double> camera_distance_mm;           ///< from the object; none: orthographic
    std::optional<std::array<double, 2>> principal_px;  ///< none: the picture's centre
    std::optional<double> ball_diameter_mm;             ///< of every mirror ball
    bool distant_lamps = false;                         ///< their light is parallel, wherever they stand
    std::vector<NominalLamp> lamps;

    friend bool operator==(const CaptureGeometry&, const CaptureGeometry&) = default;
};

/// What holds for a whole session.
struct SessionInfo {
    int schema_version = 1;
    std::string object;              ///< name given by the user
    std::string created;             ///< ISO 8601, UTC
    std::string source;              ///< "capture" or "import"
    std::string rig;                 ///< the rig's name, empty for imports
    std::string camera;              ///< model and id
    int planned_shots = 0;           ///< frames the session needs to be complete
    std::vector<std::string> notes;  ///< choices made on the way in, such as the transfer curve, in words
    std::optional<CaptureGeometry> geometry = {};
    std::optional<SessionReference> retakes = {};  ///< the session of which this one takes some lamps again
    std::optional<SessionReference> flats = {};    ///< the session that its flat frames were taken over from
    ObjectRecord record = {};                      ///< of the object
};

/// A sealed session, read only. Thread-compatible; const members are thread-safe.
class Session {
public:
    /// Throws InputError when the folder is not a sealed session of a known schema (an unsealed one is told apart, with
    /// the command that resumes it).
    static Session open(const std::filesystem::path& folder);

    const std::filesystem::path& folder() const { return folder_; }
    const SessionInfo& info() const { return info_; }
    const std::vector<FrameRecord>& frames() const { return frames_; }
    const std::vector<SessionEvent>& events() const { return events_; }

    std::filesystem::path path_of(const FrameRecord& frame) const;
    /// What another session says to refer to this one.
    SessionReference reference() const;
    /// Masks and given light files ("masks/mask.png", "given/lights.lp"), relative to data/, sorted.
    const std::vector<std::string>& extras() const { return extras_; }
    std::filesystem::path path_of_extra(const std::string& extra) const;

    /// Checks every payload and tag checksum and that every file is there and listed.
    /// Throws InputError that names the first bad file and how many are bad.
    void verify() const;

private:
    std::filesystem::path folder_;
    SessionInfo info_;
    std::vector<FrameRecord> frames_;
    std::vector<SessionEvent> events_;
    std::vector<std::string> extras_;
};

}  // namespace darkbox
