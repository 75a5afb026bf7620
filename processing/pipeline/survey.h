#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "processing/pipeline/import.h"

namespace darkbox {

/// What lies in the folders of one object, before anything is read.
struct Survey {
    std::vector<std::filesystem::path> frames;  ///< in the session's order
    std::vector<std::filesystem::path> masks;   ///< pictures whose name begins or ends with the word "mask"
    std::optional<std::filesystem::path> lights;
    std::optional<std::filesystem::path> intensities;
    std::optional<std::filesystem::path> truth;
    std::string layout;  ///< in words, for the notes
};

/// Plain folders of photographs (all of them, in natural order), RTI folders (the frames that the .lp names, in its
/// order) and DiLiGenT folders. Throws InputError: no folder, no photographs, several .lp files, a frame that is listed
/// but missing.
Survey survey_folders(const std::vector<std::filesystem::path>& folders, ImportLayout layout);

/// "mask" in the name, in any case.
bool is_mask_name(const std::filesystem::path& path);

}  // namespace darkbox
