#pragma once

#include <cstddef>

namespace darkbox {

/// Raises the process' limit of open files to `count` where it is lower: every photograph's decoder keeps its file
/// open. Throws InputError that says what to do when the system does not allow so many.
void allow_open_files(std::size_t count);

}  // namespace darkbox
