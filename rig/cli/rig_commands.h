#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/cli/command_line.h"

namespace darkbox {

/// `darkbox capture`.
void add_capture_command(CommandLine& line);
/// `darkbox rig`, `darkbox lamps` and `darkbox sessions`.
void add_rig_commands(CommandLine& line);

/// "all" is no name at all; else names between commas. Throws InputError for an empty name.
std::vector<std::string> lamps_of_plan(const std::string& plan);

/// The name, in the daemon's folder, of a session given as a name or as a path. Throws InputError for a path that leads
/// elsewhere: the daemon writes to its own folder only.
std::string name_in_folder(const std::filesystem::path& session, const std::filesystem::path& folder);

}  // namespace darkbox
