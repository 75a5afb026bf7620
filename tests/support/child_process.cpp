#include "tests/support/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace darkbox::test {
namespace {

constexpr int owner_writes = 0600;

std::string text_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& arguments, std::filesystem::path log,
                           const std::vector<int>& handed)
    : log_(std::move(log)) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, (log_.string() + ".out").c_str(), flags, owner_writes);
    ::posix_spawn_file_actions_addopen(&files, STDERR_FILENO, (log_.string() + ".err").c_str(), flags, owner_writes);
    for (std::size_t i = 0; i < handed.size(); ++i)
        ::posix_spawn_file_actions_adddup2(&files, handed[i], STDERR_FILENO + 1 + static_cast<int>(i));
    const int error = ::posix_spawn(&pid_, argv.front(), &files, nullptr, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&files);
    if (error != 0) throw std::runtime_error("cannot run " + arguments.front());
}

ChildProcess::~ChildProcess() {
    if (ended_) return;
    signal(SIGKILL);
    wait();
}

bool ChildProcess::running() {
    int status = 0;
    if (!ended_ && ::waitpid(pid_, &status, WNOHANG) == pid_) ended_with(status);
    return !ended_;
}

void ChildProcess::signal(int number) const {
    if (!ended_) ::kill(pid_, number);
}

int ChildProcess::wait() {
    int status = 0;
    if (!ended_ && ::waitpid(pid_, &status, 0) == pid_) ended_with(status);
    return status_;
}

std::string ChildProcess::out() const { return text_of(log_.string() + ".out"); }
std::string ChildProcess::err() const { return text_of(log_.string() + ".err"); }

void ChildProcess::ended_with(int wait_status) {
    constexpr int by_signal = 128;
    ended_ = true;
    status_ = WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : by_signal + WTERMSIG(wait_status);
}

}  // namespace darkbox::test
