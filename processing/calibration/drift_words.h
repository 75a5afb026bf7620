#pragma once

#include <string>
#include <vector>

#include "processing/calibration/drift.h"

namespace darkbox {

/// What a person should know of a comparison, one sentence a finding, the gravest first. Pairs are named once.
std::vector<std::string> words_of(const Drift& drift);

}  // namespace darkbox
