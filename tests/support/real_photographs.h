#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "processing/maps/maps.h"

namespace darkbox::test {

/// A picture of 8-bit linear values as R, G, B in 0...1.
inline cv::Mat3f read_linear_picture(const std::filesystem::path& file) {
    const cv::Mat stored = cv::imread(file.string(), cv::IMREAD_COLOR);
    if (stored.empty()) throw std::runtime_error("cannot read " + file.string());
    cv::Mat rgb;
    cv::cvtColor(stored, rgb, cv::COLOR_BGR2RGB);
    cv::Mat3f linear;
    rgb.convertTo(linear, CV_32F, 1.0 / 255);
    return linear;
}

/// The photographs NAME.00.png, NAME.01.png, ... of a folder NAME with its mask.png.
inline PhotoStack read_photographs(const std::filesystem::path& folder) {
    PhotoStack stack;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".png" && entry.path().filename() != "mask.png") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
        const cv::Mat3f image = read_linear_picture(file);
        cv::Mat1b clipped;
        cv::inRange(image, cv::Scalar::all(0), cv::Scalar::all(0.999), clipped);
        cv::bitwise_not(clipped, clipped);
        stack.clipped.push_back(clipped);
        stack.images.push_back(image);
        stack.files.push_back(file.filename().string());
    }
    stack.mask = cv::imread((folder / "mask.png").string(), cv::IMREAD_GRAYSCALE) > 127;
    return stack;
}

/// A count line and then x y z lines.
inline Lights read_lights(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::size_t count = 0;
    in >> count;
    Lights lights(count);
    for (Light& light : lights) {
        in >> light.direction[0] >> light.direction[1] >> light.direction[2];
        light.direction.normalize();
    }
    if (!in) throw std::runtime_error("cannot read " + file.string());
    return lights;
}

}  // namespace darkbox::test
