#include "tests/hil/machine.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "acquisition/device/unique_fd.h"

namespace darkbox::test {

namespace fs = std::filesystem;

bool in_machine() { return std::getenv("HIL_KERNEL") != nullptr; }

Printed shell(const std::string& command) {
    std::FILE* pipe = ::popen(("{ " + command + "\n} 2>&1 </dev/null").c_str(), "re");
    if (pipe == nullptr) throw std::runtime_error("popen " + command);
    Printed printed;
    std::array<char, 4096> block{};
    while (const std::size_t got = std::fread(block.data(), 1, block.size(), pipe))
        printed.text.append(block.data(), got);
    const int status = ::pclose(pipe);
    printed.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return printed;
}

void must(const std::string& command) {
    const Printed printed = shell(command);
    if (printed.status != 0)
        throw std::runtime_error(command + ": status " + std::to_string(printed.status) + ": " + printed.text);
}

std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void put(const std::string& text, const fs::path& file) {
    const UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
    if (!fd || ::write(fd.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
        throw std::runtime_error("write \"" + text + "\" to " + file.string() + ": " + std::strerror(errno));
}

bool comes_true(const std::function<bool()>& condition, std::chrono::seconds limit) {
    const auto end = std::chrono::steady_clock::now() + limit;
    while (!condition()) {
        if (std::chrono::steady_clock::now() >= end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
}

std::string program(const std::string& name) {
    return (fs::read_symlink("/proc/self/exe").parent_path() / name).string();
}

std::vector<int> processes(const std::string& name) {
    std::vector<int> found;
    for (const auto& entry : fs::directory_iterator("/proc")) {
        const std::string folder = entry.path().filename().string();
        if (!std::all_of(folder.begin(), folder.end(), [](char c) { return c >= '0' && c <= '9'; })) continue;
        if (text_of(entry.path() / "comm") == name + "\n") found.push_back(std::stoi(folder));
    }
    return found;
}

}  // namespace darkbox::test
