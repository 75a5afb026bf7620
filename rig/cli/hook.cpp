#include "rig/cli/hook.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <optional>
#include <thread>

#include "acquisition/device/device_error.h"
#include "acquisition/frame/error.h"

namespace darkbox {
namespace {

using HookClock = std::chrono::steady_clock;

constexpr auto poll_every = std::chrono::milliseconds(20);
constexpr auto patience = std::chrono::seconds(2);  ///< between asking it to end and killing it
constexpr const char* hook_hint = "run it by hand to see what it says; the captures so far are kept";

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n'; }

/// What posix_spawn() needs, and takes back.
class Spawning {
public:
    Spawning() {
        ::posix_spawn_file_actions_init(&actions_);
        ::posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        ::posix_spawn_file_actions_adddup2(&actions_, STDERR_FILENO, STDOUT_FILENO);
        ::posix_spawnattr_init(&attributes_);
        sigset_t none;
        ::sigemptyset(&none);
        ::posix_spawnattr_setsigmask(&attributes_, &none);  // darkbox blocks what its own thread waits for
        sigset_t pipe;
        ::sigemptyset(&pipe);
        ::sigaddset(&pipe, SIGPIPE);
        ::posix_spawnattr_setsigdefault(&attributes_, &pipe);
        ::posix_spawnattr_setpgroup(&attributes_, 0);
        ::posix_spawnattr_setflags(&attributes_,
                                   POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    }
    Spawning(const Spawning&) = delete;
    Spawning& operator=(const Spawning&) = delete;
    ~Spawning() {
        ::posix_spawnattr_destroy(&attributes_);
        ::posix_spawn_file_actions_destroy(&actions_);
    }

    pid_t spawn(std::vector<std::string> words, std::vector<std::string> environment) const {
        const auto raw = [](std::vector<std::string>& texts) {
            std::vector<char*> pointers;
            for (std::string& text : texts) pointers.push_back(text.data());
            pointers.push_back(nullptr);
            return pointers;
        };
        pid_t child = 0;
        const int error = ::posix_spawnp(&child, words.front().c_str(), &actions_, &attributes_, raw(words).data(),
                                         raw(environment).data());
        if (error != 0) throw_errno("start the hook", words.front(), error);
        return child;
    }

private:
    posix_spawn_file_actions_t actions_{};
    posix_spawnattr_t attributes_{};
};

std::vector<std::string> environment_with(const std::map<std::string, std::string>& added) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string text = *entry;
        if (!added.contains(text.substr(0, text.find('=')))) all.push_back(text);
    }
    for (const auto& [name, value] : added) all.push_back(fmt::format("{}={}", name, value));
    return all;
}

/// Its status once it ended.
std::optional<int> ended(pid_t child) {
    int status = 0;
    const pid_t got = ::waitpid(child, &status, WNOHANG);
    if (got == child) return status;
    if (got < 0 && errno != EINTR) throw_errno("waitpid", "the hook", errno);
    return std::nullopt;
}

void end_group(pid_t child) {
    ::kill(-child, SIGTERM);
    const auto until = HookClock::now() + patience;
    bool reaped = false;
    while (!reaped && HookClock::now() < until) {
        reaped = ended(child).has_value();
        std::this_thread::sleep_for(poll_every);
    }
    ::kill(-child, SIGKILL);  // also what it left behind
    if (!reaped) ::waitpid(child, nullptr, 0);
}

void require_success(const std::string& command, int status) {
    if (WIFSIGNALED(status))
        throw DeviceError(fmt::format("the hook {} was ended by signal {}", command, WTERMSIG(status)), hook_hint);
    if (WEXITSTATUS(status) != 0)
        throw DeviceError(fmt::format("the hook {} failed with status {}", command, WEXITSTATUS(status)), hook_hint);
}

}  // namespace

std::vector<std::string> split_words(const std::string& command) {
    std::vector<std::string> words;
    std::optional<std::string> word;
    char quote = 0;
    const auto add = [&word](char c) { word = word.value_or("") + c; };
    for (std::size_t i = 0; i < command.size(); ++i) {
        const char c = command[i];
        const bool last = i + 1 == command.size();
        if (c == '\\' && quote != '\'' && !last && (quote == 0 || command[i + 1] == '"' || command[i + 1] == '\\')) {
            add(command[++i]);
        } else if (c == quote && quote != 0) {
            quote = 0;
        } else if (quote == 0 && (c == '"' || c == '\'')) {
            quote = c;
            word = word.value_or("");  // "" is a word, too
        } else if (quote == 0 && is_blank(c)) {
            if (word) words.push_back(*word);
            word.reset();
        } else {
            add(c);
        }
    }
    if (quote != 0) throw InputError(fmt::format("the command {} ends within a quote", command), "close the quote");
    if (word) words.push_back(*word);
    if (words.empty()) throw InputError("the command is empty", "name a program");
    return words;
}

void run_hook(const Hook& hook, const std::map<std::string, std::string>& environment, const std::stop_token& stop) {
    const std::string& command = hook.words.front();
    const pid_t child = Spawning().spawn(hook.words, environment_with(environment));
    const auto deadline = HookClock::now() + hook.deadline;
    while (true) {
        if (const auto status = ended(child)) return require_success(command, *status);
        if (stop.stop_requested()) {
            end_group(child);
            throw Cancelled(fmt::format("the hook {} was stopped", command), "the captures so far are kept");
        }
        if (HookClock::now() >= deadline) {
            end_group(child);
            throw DeviceError(
                fmt::format("the hook {} was not done after {} s and was ended", command, hook.deadline.count()),
                "give it more time with --between-timeout, or see why it hangs");
        }
        std::this_thread::sleep_for(poll_every);
    }
}

}  // namespace darkbox
