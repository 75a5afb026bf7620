#pragma once

#include "rig/cli/command_line.h"

namespace darkbox {

// Each function adds its subcommands to the command line. One file per group of commands that belong together.

void add_import_command(CommandLine& line);
void add_stage_commands(CommandLine& line);  ///< calibrate, normals, texels, shade, process, report
void add_relight_command(CommandLine& line);
void add_transfer_command(CommandLine& line);
void add_measure_command(CommandLine& line);  ///< measure-transfer
void add_evaluate_command(CommandLine& line);
void add_drift_command(CommandLine& line);
void add_session_commands(CommandLine& line);  ///< verify, export

}  // namespace darkbox
