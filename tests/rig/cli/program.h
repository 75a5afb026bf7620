#pragma once

#include <string>
#include <vector>

namespace darkbox::test {

struct ProgramResult {
    int status = -1;  ///< exit status; 128 + signal when it was killed
    std::string out;
    std::string err;
};

/// Runs the built `darkbox` with these arguments and waits for it.
ProgramResult darkbox_program(const std::vector<std::string>& arguments);

}  // namespace darkbox::test
