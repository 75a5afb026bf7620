#pragma once

#include <filesystem>

#include "rig/daemon/processing_lane.h"

namespace darkbox {

/// Processing by the program `darkbox` as a process of its own, in the kernel's idle classes for processor and disk, so
/// that it only gets what a capture leaves. It ends with the daemon, whatever ends that.
RunProcessing processing_by(const std::filesystem::path& program);

/// The arguments after the program's name that do this job. Throws InputError for orders that make no sense.
std::vector<std::string> processing_arguments(const Job& job, const std::filesystem::path& session);

/// `darkbox` beside the running program, where it is.
std::filesystem::path darkbox_beside_this_program();

}  // namespace darkbox
