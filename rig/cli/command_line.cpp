#include "rig/cli/command_line.h"

#include <fmt/color.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

#include "acquisition/frame/error.h"
#include "rig/cli/arguments.h"
#include "rig/cli/interrupt.h"
#include "rig/cli/progress_bar.h"

namespace darkbox {
namespace {

/// Unlike fmt::print, which throws when stderr is closed: there would be nobody left to tell.
void put(const std::string& text) { std::fputs(text.c_str(), stderr); }

/// A reader that has read enough and left (`darkbox ... | head`) is no failure.
void put_out(const std::string& text) {
    if (std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0) return;
    if (errno != EPIPE) throw Error("the result could not be written to stdout", "is the disk full?");
}

/// Long names of the options on the command line, without their dashes.
std::vector<std::string> given_options(const CLI::App& app) {
    std::vector<std::string> given;
    for (const CLI::Option* option : app.get_options())
        if (option->count() > 0)
            for (const std::string& name : option->get_lnames()) given.push_back(name);
    for (const CLI::App* command : app.get_subcommands())
        for (std::string& name : given_options(*command)) given.push_back(std::move(name));
    return given;
}

void print_error(const std::string& what, const std::string& hint) {
    const bool colour = ::isatty(STDERR_FILENO) != 0;
    const auto style = colour ? fmt::fg(fmt::terminal_color::red) | fmt::emphasis::bold : fmt::text_style();
    put(fmt::format("{} {}\n", fmt::format(style, "error:"), what));
    if (!hint.empty()) put(fmt::format("  {}\n", hint));
}

std::string printed(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace); }

/// What darkboxd reads of the commands it runs.
void put_progress(const ProgressUpdate& update) {
    const Json json{{"stage", update.stage}, {"done", update.done}, {"total", update.total}, {"detail", update.detail}};
    put("progress " + json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
}

void print_warning(const std::string& warning) {
    const bool colour = ::isatty(STDERR_FILENO) != 0;
    const auto style = colour ? fmt::text_style(fmt::fg(fmt::terminal_color::yellow)) : fmt::text_style();
    put(fmt::format("{} {}\n", fmt::format(style, "warning:"), warning));
}

}  // namespace

CommandLine::CommandLine() : app_("Photometric capture and relighting", "darkbox") {
    app_.set_version_flag("--version", std::string("darkbox ") + DARKBOX_VERSION);
    app_.require_subcommand(1);
    app_.footer(
        "Every command has --help with an example.\n"
        "Exit status: 0 done, 1 failed, 2 wrong usage, 3 finished with warnings under --strict.");
}

CLI::App& CommandLine::add(const std::string& name, const std::string& description, const std::string& example,
                           Body body, CLI::App* parent) {
    CLI::App& command = *(parent != nullptr ? parent : &app_)->add_subcommand(name, description);
    command.add_flag("--json", json_, "Print one JSON object on stdout");
    command.add_flag("--strict", strict_, "Exit with status 3 when there were warnings");
    command.add_flag("--progress-lines", progress_lines_, "Tell progress as lines of JSON on stderr")->group("");
    command.add_option("--threads", threads_, "Threads to use; 0 = all cores")->check(CLI::Range(0, 1024));
    command.footer("Example:\n  " + example);
    // A command with commands below it is only meant where none of those is.
    command.callback([this, &command, body = std::move(body)] {
        if (command.get_subcommands().empty()) chosen_ = body;
    });
    return command;
}

CLI::App& CommandLine::add_group(const std::string& name, const std::string& description) {
    CLI::App& group = *app_.add_subcommand(name, description);
    group.require_subcommand(1);
    return group;
}

int CommandLine::run(int argc, char** argv) {
    try {
        return parse_and_run(argc, argv);
    } catch (const UsageError& error) {
        return fail(error.what(), error.hint(), exit_usage);
    } catch (const Error& error) {
        return fail(error.what(), error.hint());
    } catch (const std::bad_alloc&) {
        return fail("out of memory", "close other programs, or work on smaller pictures");
    } catch (const std::exception& error) {
        return fail(fmt::format("unexpected: {}", error.what()), "this is a defect of darkbox; please report it");
    }
}

int CommandLine::fail(const std::string& what, const std::string& hint, ExitStatus status) const {
    print_error(what, hint);
    if (json_) std::fputs((printed({{"error", what}, {"hint", hint}}) + "\n").c_str(), stdout);
    return status;
}

/// Options are checked by the stages, which call them by their fields' names.
CommandResult CommandLine::run_chosen(const WorkContext& work) const {
    try {
        return (*chosen_)(work);
    } catch (const UsageError&) {
        throw;
    } catch (const InputError& error) {
        throw InputError(in_options(error.what(), given_options(app_)), error.hint());
    }
}

int CommandLine::parse_and_run(int argc, char** argv) {
    Interrupt interrupt;  // before anything starts a thread, so that all of them leave SIGINT and SIGTERM to it
    try {
        app_.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app_.exit(error) == 0 ? exit_done : exit_usage;
    }
    ProgressBar bar;
    WorkContext work;
    work.report = [&bar](const ProgressUpdate& update) { bar.show(update); };
    if (progress_lines_) work.report = put_progress;
    work.stop = interrupt.token();
    work.threads = threads_;

    const CommandResult result = run_chosen(work);
    bar.finish();
    for (const std::string& warning : result.warnings) print_warning(warning);
    for (const std::string& failure : result.failures) print_error(failure, "");
    if (json_) {
        Json json = result.json;
        if (!json.contains("warnings")) json["warnings"] = result.warnings;
        if (!result.failures.empty()) json["failures"] = result.failures;
        put_out(printed(json) + "\n");
    } else if (!result.text.empty()) {
        put_out(result.text + "\n");
    }
    if (!result.failures.empty()) return exit_failed;
    return strict_ && !result.warnings.empty() ? exit_warnings : exit_done;
}

}  // namespace darkbox
