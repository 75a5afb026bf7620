#include "rig/cli/commands.h"
#include "rig/cli/rig_commands.h"

int main(int argc, char** argv) {
    darkbox::CommandLine line;
    darkbox::add_capture_command(line);
    darkbox::add_import_command(line);
    darkbox::add_stage_commands(line);
    darkbox::add_relight_command(line);
    darkbox::add_transfer_command(line);
    darkbox::add_measure_command(line);
    darkbox::add_evaluate_command(line);
    darkbox::add_drift_command(line);
    darkbox::add_session_commands(line);
    darkbox::add_rig_commands(line);
    darkbox::add_ageing_command(line);
    darkbox::add_doctor_command(line);
    return line.run(argc, argv);
}
