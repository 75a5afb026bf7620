#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "processing/maps/lights.h"

namespace darkbox {

enum class LightFileForm {
    lp,       ///< N, then `filename x y z`
    counted,  ///< N, then `x y z`
    bare,     ///< `x y z` alone (DiLiGenT)
};

struct LightFile {
    Lights lights;  ///< unit directions, intensity 1; `file` is a basename, empty where the form has no names
    LightFileForm form = LightFileForm::lp;
    std::vector<std::string> warnings;  ///< decimal commas, vectors that were not of unit length
};

/// The form is recognised by what the file holds. Reads CRLF, tabs, decimal commas, paths and spaces in names. Throws
/// InputError with the file and line: not a number, a norm below 1e-4, a count that does not fit.
LightFile read_lights(const std::filesystem::path& path);

/// `r g b` (or one number) for each light, all of them positive. Throws InputError with the file and line.
std::vector<Eigen::Vector3d> read_light_intensities(const std::filesystem::path& path);

/// The used lights, in the C locale: basenames, spaces replaced by underscores.
void write_lp(const std::filesystem::path& path, const Lights& lights);

/// A line for each light, by its place: DiLiGenT's light_directions.txt and light_intensities.txt.
void write_light_directions(const std::filesystem::path& path, const Lights& lights);
void write_light_intensities(const std::filesystem::path& path, const Lights& lights);

}  // namespace darkbox
