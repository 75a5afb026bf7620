#pragma once

#include "acquisition/frame/progress.h"
#include "processing/maps/photo_source.h"
#include "processing/shading/shading.h"

namespace darkbox {

struct ShadingBands {
    /// Photographs stay in memory as they were decoded where they and the maps fit into so much; else they are read
    /// three times, by bands of rows.
    int memory_mib = 4096;
    int rows = 0;  ///< of a band; 0: as memory_mib allows. It does not change results.

    /// Throws InputError that names the field and the allowed range.
    void validate() const;
};

/// shading_maps() of photographs that need not be in memory together; they stand at the top. Bit-identical for any
/// height of the bands. Throws InputError also when memory_mib holds not even two rows.
ShadingResult shading_maps(PhotoSource& photos, const Lights& lights, const NormalMap& normals, const AlbedoMap& albedo,
                           const IndexMap& index, const ShadingOptions& options, const ShadingBands& bands,
                           const WorkContext& work);

}  // namespace darkbox
