#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/capture/capture_run.h"
#include "rig/capture/session_review.h"
#include "rig/capture/told_sink.h"

namespace darkbox {

enum class CaptureStart {
    create,  ///< a new session in an absent or empty folder
    resume,  ///< goes on with an interrupted one
};

/// Which exposure a capture is to have.
struct ExposureChoice {
    std::optional<Seconds> fixed;  ///< none: metered; see meter.h
};

struct CaptureRequest {
    std::filesystem::path folder;    ///< of the session
    std::string object;              ///< name given by the user; a resumed session keeps its own
    std::vector<std::string> lamps;  ///< names; empty = all, or the interrupted session's own
    CaptureStart start = CaptureStart::create;
    std::optional<SyncMode> mode = {};            ///< none: the one of rig.toml
    std::optional<ExposureChoice> exposure = {};  ///< none: as rig.toml says; a resumed session keeps its own
    /// A sealed session of which `lamps` are taken again: the new one refers to it and takes the rest over.
    std::optional<std::filesystem::path> retake = {};
    ObjectRecord record = {};  ///< of the object; a resumed session keeps its own
    /// lit; or flat, of a grey or white card that lies in the object's place. A resumed session keeps its own.
    FrameKind kind = FrameKind::lit;
    /// A sealed session of kind flat whose frames of `lamps` go along; they tell the lamps' intensities.
    std::optional<std::filesystem::path> flats = {};
    CaptureListener listener = {};
    ReviewSession review = {};            ///< of the whole session before it is sealed; empty: none
    std::vector<std::string> notes = {};  ///< what the session is to keep of how it began
};

struct CapturedSession {
    Session session;  ///< sealed
    CaptureSummary summary;
    std::vector<std::string> findings;  ///< of the review, also among the session's events
};

/// What the rig's description knows of the geometry, for the session.
CaptureGeometry geometry_of(const RigDescription& rig);

/// The head of a session of this plan, created now.
SessionInfo session_info(const RigDescription& rig, const CameraInfo& camera, const std::string& object,
                         const CapturePlan& plan);

/// The whole capture: meters where that is asked for, starts or resumes the session, keeps rig.toml in it, takes every
/// shot, seals. Lamps are dark when it returns or throws; whatever was acknowledged stays and can be resumed. Throws
/// what run_capture() throws, and InputError when an interrupted session was begun with another rig.toml or other
/// lamps, and what meter_exposure() and plan_retake() throw.
CapturedSession capture_session(const CaptureRequest& request, const RigDescription& rig, LampArray& lamps,
                                Camera& camera, Clock& clock, const WorkContext& work = {},
                                const TimingLookup& timings = {});

}  // namespace darkbox
