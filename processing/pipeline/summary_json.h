#pragma once

#include <nlohmann/json.hpp>

#include "processing/pipeline/stages.h"

namespace darkbox {

/// What `--json` prints for each stage; keys as the command line documents them.
nlohmann::ordered_json to_json(const CalibrateSummary& summary);
nlohmann::ordered_json to_json(const NormalsSummary& summary);
nlohmann::ordered_json to_json(const TexelsSummary& summary);
nlohmann::ordered_json to_json(const ShadeSummary& summary);
nlohmann::ordered_json to_json(const ReportSummary& summary);
nlohmann::ordered_json to_json(const ProcessSummary& summary);

}  // namespace darkbox
