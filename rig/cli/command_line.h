#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/frame/error.h"
#include "acquisition/frame/progress.h"

namespace darkbox {

using Json = nlohmann::ordered_json;

/// What a command has to say when it is done.
struct CommandResult {
    Json json = Json::object();              ///< what --json prints on stdout
    std::string text;                        ///< what people read on stdout without --json
    std::vector<std::string> warnings;       ///< sentences for people; with --strict they make the exit status 3
    std::vector<std::string> failures = {};  ///< what was examined and found wanting; they make the exit status 1
};

/// Exit statuses, the same for every command.
enum ExitStatus { exit_done = 0, exit_failed = 1, exit_usage = 2, exit_warnings = 3 };

/// The command line itself is at fault, whatever the files hold: exit_usage.
class UsageError : public InputError {
public:
    using InputError::InputError;
};

/// The `darkbox` command line: subcommands register themselves here, run() parses, runs the chosen one, and is the one
/// place that catches. Thread-compatible.
class CommandLine {
public:
    using Body = std::function<CommandResult(const WorkContext&)>;

    CommandLine();

    /// A subcommand of `parent` (or of darkbox itself) that runs `body` when chosen. `example` is shown by --help.
    /// Every subcommand takes --json, --strict and --threads N as well.
    CLI::App& add(const std::string& name, const std::string& description, const std::string& example, Body body,
                  CLI::App* parent = nullptr);
    /// A subcommand that only groups others ("rig", "lamps").
    CLI::App& add_group(const std::string& name, const std::string& description);

    int run(int argc, char** argv);

private:
    int parse_and_run(int argc, char** argv);
    CommandResult run_chosen(const WorkContext& work) const;
    int fail(const std::string& what, const std::string& hint, ExitStatus status = exit_failed) const;

    CLI::App app_;
    std::optional<Body> chosen_;
    bool json_ = false;
    bool strict_ = false;
    bool progress_lines_ = false;
    int threads_ = 0;
};

}  // namespace darkbox
