#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "processing/calibration/calibration.h"

namespace darkbox {

struct ReportPicture {
    cv::Mat3b image;  ///< R, G, B, for looking at
    std::string title;
    std::string caption;
    std::string file = {};  ///< relative to the page: where all of it is; empty: nowhere
};

/// One frame's outline and reading on the ball picture.
struct ReportBall {
    cv::Mat3b image;  ///< brightest of all ball frames
    std::vector<Ball> balls;
    std::vector<std::pair<std::string, Highlight>> highlights;
};

/// All that a session's report shows; parts that are empty are left out.
struct ReportContent {
    std::string title;
    std::vector<std::string> warnings;                       ///< in words, shown on top
    std::vector<std::pair<std::string, std::string>> facts;  ///< name, value
    std::vector<ReportPicture> pictures;
    std::vector<ReportPicture> relit;
    Lights lights;
    double condition_number = 0;
    std::optional<ReportBall> ball;
    std::vector<double> exposure_histogram;               ///< shares of samples, equal bins over 0...1
    std::vector<std::pair<std::string, double>> timings;  ///< stage, seconds
};

/// One self-contained page: pictures, plots and style are inside; no scripts; every name is escaped. Files with more
/// than a picture shows are linked beside it.
std::string report_html(const ReportContent& content);

}  // namespace darkbox
