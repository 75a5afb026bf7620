#include "processing/pipeline/shade_stage.h"
#include "processing/pipeline/stages.h"

namespace darkbox {

ProcessSummary run_process(const Session& session, const ProcessOptions& options, const WorkContext& work) {
    options.calibrate.calibration.validate();
    options.normals.stereo.validate();
    options.texels.validate();
    options.shading.validate();
    ProcessSummary summary;
    summary.calibrate = run_calibrate(session, options.calibrate, work);
    summary.normals = run_normals(session, options.normals, work);
    summary.texels = run_texels(session, options.texels, work);
    ShadingBands bands;
    bands.memory_mib = options.normals.stereo.memory_mib;
    summary.shade = run_shade(session, options.shading, bands, work);
    summary.report = run_report(session, work);
    return summary;
}

}  // namespace darkbox
