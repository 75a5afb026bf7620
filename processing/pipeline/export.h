#pragma once

#include <filesystem>
#include <string_view>

#include "acquisition/frame/progress.h"
#include "acquisition/session/session.h"

namespace darkbox {

enum class ExportFormat {
    lp,           ///< one file: the calibrated lights
    diligent,     ///< a folder: 16-bit linear PNGs, mask, lights, intensities, names
    ptm,          ///< one file: a polynomial texture map, one polynomial for the luminance (LRGB)
    ptm_rgb,      ///< one file: a polynomial texture map, one polynomial for each channel
    relight,      ///< a folder for viewers in a browser (Relight, OpenLIME): LRGB
    relight_rgb,  ///< the same with one polynomial for each channel
    ply,          ///< one file: the surface
};

/// Throws InputError that lists the names there are.
ExportFormat export_format(std::string_view name);

/// Texture maps are fitted to the photographs, each divided by its light's intensity and encoded as
/// sRGB, since viewers show samples as they are; they pass by in bands of rows. Throws InputError when the
/// needed artefact is missing (the hint is the command to run) or `out` cannot be written.
void export_session(const Session& session, ExportFormat format, const std::filesystem::path& out,
                    const WorkContext& work = {});

}  // namespace darkbox
