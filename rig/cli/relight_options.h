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
    std::vector<std::string> environments;
    RelightOptions options;
    double yaw_deg = 0;
    std::string specular_colour;
};

/// Adds --light, --environment, --yaw, --lookup, --exposure, --model and what belongs to the models.
void add_relight_options(CLI::App& command, RelightArguments& arguments);

/// Options with degrees turned into radians and colours parsed, validated.
RelightOptions relight_options(const RelightArguments& arguments);

}  // namespace darkbox
