#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/session/session.h"

namespace darkbox {

// Names inside a session, as docs and interfaces promise them.

inline constexpr const char* object_mask = "masks/mask.png";
inline constexpr const char* ball_mask = "masks/ball_mask.png";
inline constexpr const char* given_lp = "given/lights.lp";
inline constexpr const char* given_plain_lights = "given/lights.txt";
inline constexpr const char* given_intensities = "given/light_intensities.txt";
inline constexpr const char* given_truth = "given/Normal_gt.mat";
inline constexpr const char* given_ball = "given/ball.json";

/// Derived files: they may be deleted and made again.
struct ResultFiles {
    explicit ResultFiles(const std::filesystem::path& session);
    std::filesystem::path calibration, lights_lp, ball_picture, calibration_summary;
    std::filesystem::path normals, normals_png, albedo, albedo_png, confidence, height, surface, shadows,
        results_summary;
    std::filesystem::path index, texels;
    std::filesystem::path shading, shading_json, shading_albedo, shading_summary;
    std::filesystem::path results_folder, report;
};

/// Throws InputError whose hint is the command to run first.
void require_made(const std::filesystem::path& file, const Session& session, const char* command);

/// Removes these folders of derived files: they were made from what is about to change. The report goes with them.
/// Returns the folders that were there.
std::vector<std::string> remove_derived(const Session& session, const std::vector<std::string>& folders);

/// One frame for each photograph: where a captured session has several of one lamp (averages, brackets), the first of
/// them stands for all; see merge_exposures.h.
std::vector<FrameRecord> photographs_of(const Session& session, FrameKind kind);
/// All frames of the photograph that this one stands for, itself included.
std::vector<FrameRecord> frames_of_photograph(const Session& session, const FrameRecord& photograph);
/// Exposure, gain and size.
bool same_controls(const FrameRecord& a, const FrameRecord& b);

std::vector<FrameRecord> frames_of_kind(const Session& session, FrameKind kind);
std::string basename_of(const FrameRecord& frame);
/// The path of a mask or given file where the session has it.
std::optional<std::filesystem::path> extra_of(const Session& session, const char* name);

}  // namespace darkbox
