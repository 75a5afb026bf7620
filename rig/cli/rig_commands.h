#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "rig/cli/command_line.h"

namespace darkbox {

/// `darkbox capture`.
void add_capture_command(CommandLine& line);
/// `darkbox rig`, and the commands below.
void add_rig_commands(CommandLine& line);

/// `darkbox sessions`, `darkbox calibrations` and `darkbox jobs`.
void add_catalog_commands(CommandLine& line);

/// `darkbox sessions prune`, below the command `sessions`.
void add_prune_command(CommandLine& line, CLI::App& sessions);

/// `darkbox doctor`.
void add_doctor_command(CommandLine& line);
/// `darkbox ageing`.
void add_ageing_command(CommandLine& line);

/// `darkbox lamps`.
void add_lamps_commands(CommandLine& line);

/// `darkbox lamps flash`, into the group `lamps`.
void add_lamps_flash_command(CommandLine& line, CLI::App& lamps);

/// `darkbox rig measure-latency`, into the group `rig`.
void add_measure_latency_command(CommandLine& line, CLI::App& rig);

/// `darkbox rig plan`, into the group `rig`.
void add_rig_plan_command(CommandLine& line, CLI::App& rig);

/// [[lamps.lamp]] sections of a rig.toml, lamp-01 on channel 0 and so on. Positions in the rig frame, mm.
std::string lamps_toml(const std::vector<Eigen::Vector3d>& positions_mm);

/// "all" is no name at all; else names between commas. Throws InputError for an empty name.
std::vector<std::string> lamps_of_plan(const std::string& plan);

/// The name, in the daemon's folder, of a session given as a name or as a path. Throws InputError for a path that leads
/// elsewhere: the daemon writes to its own folder only.
std::string name_in_folder(const std::filesystem::path& session, const std::filesystem::path& folder);

}  // namespace darkbox
