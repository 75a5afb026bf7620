#pragma once

#include <filesystem>
#include <string_view>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"

namespace darkbox {

enum class ExportFormat {
    lp,        ///< one file: the calibrated lights
    diligent,  ///< a folder: 16-bit linear PNGs, mask, lights, intensities, names
    ply,       ///< one file: the surface
};

/// Throws InputError that lists the names there are.
ExportFormat export_format(std::string_view name);

/// Throws InputError when the needed artefact is missing (the hint is the command to run) or `out` cannot be written.
void export_session(const Session& session, ExportFormat format, const std::filesystem::path& out,
                    const WorkContext& work = {});

}  // namespace darkbox
