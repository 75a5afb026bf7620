#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"
#include "processing/calibration/calibration.h"

namespace darkbox {

enum class ImportTransfer {
    automatic,  ///< an embedded profile, else linear for 16-bit and float, sRGB for 8-bit
    linear,
    srgb,
};

enum class ImportLayout {
    automatic,  ///< DiLiGenT when filenames.txt and light_directions.txt are there, else plain (an .lp file is read)
    plain,
    diligent,
};

struct ImportOptions {
    std::vector<std::filesystem::path> folders;        ///< one object's photographs, in the order given
    std::filesystem::path out;                         ///< the session's folder, absent or empty
    std::optional<std::filesystem::path> ball_images;  ///< a ball in the object's place under the same lamps
    std::optional<std::filesystem::path> flat_images;  ///< a diffuse plane there: tells the lamps' intensities
    std::vector<Ball> balls;                           ///< pixels
    std::optional<double> ball_diameter_mm;            ///< of every ball; tells the scale
    std::optional<std::filesystem::path> ball_mask;    ///< 255 on the ball
    std::optional<std::filesystem::path> mask;         ///< 255 on the object
    std::optional<std::filesystem::path> lights;       ///< any form that read_lights() knows
    ImportTransfer transfer = ImportTransfer::automatic;
    ImportLayout layout = ImportLayout::automatic;
    std::string object;        ///< empty: the first folder's name
    ObjectRecord record = {};  ///< what else is known of it

    /// Throws InputError that names the field.
    void validate() const;
};

/// Photographs from any camera become a sealed session: their bytes, masks, given lights and truth are copied; the
/// choice of transfer curve is recorded per frame and in the notes, with warnings in words (SessionInfo::notes that
/// begin with "warning: "). Names are ordered naturally; a picture whose name begins or ends with the word "mask" is a
/// mask, of the object or, beside the ball's photographs, of the ball. Throws InputError: a file that cannot be read,
/// two sizes (both files are named), photographs of the ball or the plane, or lights, of another count.
Session import_photographs(const ImportOptions& options, const WorkContext& work = {});

}  // namespace darkbox
