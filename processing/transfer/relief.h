#pragma once

#include <opencv2/core.hpp>

#include "processing/transfer/pyramid.h"

namespace darkbox {

/// The target's normals with the source's fine relief on them (pipeline, texture replacement: bump moves with the
/// texture): n = R n_source, read through the coordinates, where R is the smallest rotation that takes the source's
/// low-pass normal there to the target's normal. `smooth` holds the source's low-pass normals. Without relief the
/// target's normals come out as they are.
NormalMap moved_relief(const NormalMap& source, const MapLevel& smooth, const cv::Mat2i& coordinates,
                       const NormalMap& target);

/// v turned by the smallest rotation that takes the unit vector `from` to the unit vector `to`; by half a turn about
/// any axis across where they are opposite.
cv::Vec3f turned(const cv::Vec3f& v, const cv::Vec3f& from, const cv::Vec3f& to);

}  // namespace darkbox
