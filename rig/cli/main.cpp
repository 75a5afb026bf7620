#include "rig/cli/command_line.h"

int main(int argc, char** argv) {
    darkbox::CommandLine line;
    return line.run(argc, argv);
}
