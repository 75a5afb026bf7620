#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace darkbox::test {

/// Whether this is the virtual machine of ./run hil. These tests load modules and plug devices: nowhere else.
bool in_machine();

/// Skips the running test, visibly, elsewhere.
#define DARKBOX_NEED_MACHINE() \
    if (!darkbox::test::in_machine()) GTEST_SKIP() << "runs in the virtual machine of ./run hil"

/// What a program printed (both streams) and its exit status.
struct Printed {
    int status = -1;
    std::string text;
};
/// Runs a command line of the shell to its end.
Printed shell(const std::string& command);
/// Runs it and throws with what it printed when it fails.
void must(const std::string& command);

std::string text_of(const std::filesystem::path& file);
/// Throws when the kernel does not take it.
void put(const std::string& text, const std::filesystem::path& file);

/// Asked again and again; emulation is slow, and slower where its host does other things as well, so the limit is far
/// from what a real machine takes.
bool comes_true(const std::function<bool()>& condition, std::chrono::seconds limit = std::chrono::seconds(40));
/// For what a program does as soon as it has started: that alone may take half a minute.
constexpr std::chrono::seconds start_of_a_program{120};

/// A program of this build.
std::string program(const std::string& name);
/// The processes of this name, as /proc/PID/comm tells it.
std::vector<int> processes(const std::string& name);

}  // namespace darkbox::test
