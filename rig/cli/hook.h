#pragma once

#include <chrono>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

namespace darkbox {

/// A command as words: blanks part them; quotes and backslashes keep blanks as a POSIX shell would ('...' as it stands;
/// "..." with \\ before a double quote or a backslash). Nothing is expanded: no variables, globs, pipes or
/// substitution. Throws InputError for an open quote and for no word at all.
std::vector<std::string> split_words(const std::string& command);

/// A command that people let run between captures, such as one that moves a turntable.
struct Hook {
    std::vector<std::string> words;
    std::chrono::seconds deadline{60};
};

/// Runs it in a process group of its own and waits for its end; no shell takes part. Its stdout goes to stderr, its
/// stdin is empty, and `environment` is added to this program's. Throws DeviceError that names the command when it
/// cannot be started, fails, or is not done by the deadline; Cancelled when the token stops. In the last two cases its
/// whole group has been asked to end (SIGTERM), and was made to (SIGKILL) two seconds later.
void run_hook(const Hook& hook, const std::map<std::string, std::string>& environment, const std::stop_token& stop);

}  // namespace darkbox
