#pragma once

#include "processing/pipeline/stages.h"
#include "processing/shading/shading_bands.h"

namespace darkbox {

/// run_shade() within a memory of choice.
ShadeSummary run_shade(const Session& session, const ShadingOptions& options, const ShadingBands& bands,
                       const WorkContext& work);

}  // namespace darkbox
