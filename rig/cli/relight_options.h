#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "processing/relight/relight.h"
#include "rig/cli/command_line.h"

namespace darkbox {

/// What a scene is to be lit by, as given on the command line: relight and transfer share these.
struct RelightArguments {
    std::vector<std::string> lights;
    std::vector<std::string> lamp_positions;
    std::vector<std::string> environments;
    RelightOptions options;
    double yaw_deg = 0;
    std::string specular_colour;
};

/// Adds --light, --light-position, --environment, --yaw, --lookup, --exposure, --model and what belongs to the models.
void add_relight_options(CLI::App& command, RelightArguments& arguments);

/// Throws InputError for lights that cannot be read.
void require_readable_lights(const RelightArguments& arguments);

/// Those of --light, then those of --light-position, whose intensities hold at the object's centroid in the plane z =
/// 0. `scene` has a view where there is a --light-position.
Lights lights_of(const RelightArguments& arguments, const RelightScene& scene);

/// As "model=phong", "light=0,0,1": for the pictures' provenance.
std::vector<std::string> described(const RelightArguments& arguments);

/// Options with degrees turned into radians and colours parsed, validated.
RelightOptions relight_options(const RelightArguments& arguments);

}  // namespace darkbox
