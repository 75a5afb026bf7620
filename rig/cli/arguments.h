#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "processing/calibration/calibration.h"
#include "processing/calibration/intensity.h"
#include "processing/maps/lights.h"

namespace darkbox {

// What people write on the command line, as the types that stages take. Each throws UsageError that quotes the argument
// and says the form that is expected.

/// "1,2,3": exactly `count` finite numbers.
std::vector<double> parse_numbers(const std::string& option, const std::string& text, std::size_t count);

/// "X,Y,R" in pixels.
Ball parse_ball(const std::string& text);

/// "X,Y,WIDTH,HEIGHT" in whole pixels.
GreyCard parse_grey_card(const std::string& text);

/// "FRAME=X,Y".
std::pair<std::string, cv::Point2d> parse_highlight(const std::string& text);

/// "X,Y,Z" of any length but zero, or "X,Y,Z:R,G,B" with an intensity per channel; the direction is made unit length.
Light parse_light(const std::string& text);

/// "X,Y,Z" in millimetres of the viewer frame, or "X,Y,Z:R,G,B" with the intensity per channel as it arrives at
/// `object_mm`.
Light parse_lamp_position(const std::string& text, const Eigen::Vector3d& object_mm);

/// A stage's message "field is VALUE" with the option's name in the field's place, where that option is among those
/// `given` on the command line (long names, without dashes): memory_mib is --memory-mib, normal_sigma is --sigma.
std::string in_options(const std::string& message, const std::vector<std::string>& given);

/// Throws InputError when this output lies in the payload of a session: that is never edited.
void require_outside_payload(const std::filesystem::path& out);

}  // namespace darkbox
