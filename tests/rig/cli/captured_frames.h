#pragma once

#include <filesystem>
#include <string>

#include "acquisition/session/session.h"

namespace darkbox::test {

/// rig.toml of a small simulated rig that is quick to render.
std::string small_rig(int lamps);

/// Frames acknowledged or sealed in a session's folder so far.
std::size_t frames_on_disk(const std::filesystem::path& session);

/// The difference of two frames over what their sensor's noise (shot, read, rounding) lets expect, as a mean of squares
/// over the pixels: 0 for equal frames, 1 for two exposures of the same light, far more for another light.
double difference_in_noise(const Session& a, const FrameRecord& in_a, const Session& b, const FrameRecord& in_b);

/// Checks that the session is sealed, verifies, holds the same shots as the reference and every frame shows its light.
void expect_same_light(const Session& session, const Session& reference);

}  // namespace darkbox::test
