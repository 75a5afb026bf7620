#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/device/device_error.h"
#include "rig/cli/rig_commands.h"
#include "rig/lamps/lamp_controller.h"
#include "rig/lamps/lamp_image.h"

extern char** environ;

namespace darkbox {
namespace {

namespace fs = std::filesystem;
using namespace lamp_protocol;

constexpr auto restart_patience = std::chrono::seconds(15);
/// Where somebody has to press a button first.
constexpr auto reset_patience = std::chrono::seconds(60);

struct FlashArguments {
    fs::path image;
    std::string serial;
    std::string label;
    int lamps = 64;
    int most_lit = 1;
    double max_on_s = 5;
    int hot = 200;
    std::string programmer = "dfu-programmer";
    bool older = false;
};

/// Runs a program of the PATH to its end; its output goes to stderr, where progress belongs.
int run(const std::vector<std::string>& arguments) {
    std::vector<char*> words;
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, 2, 1);
    pid_t child = 0;
    const int error = posix_spawnp(&child, words.front(), &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0)
        throw_errno(
            "starting", arguments.front(), error,
            fmt::format("install it (apt-get install {}), or name another with --programmer", arguments.front()));
    int status = 0;
    if (waitpid(child, &status, 0) < 0) throw_errno("waiting for", arguments.front(), errno);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

/// avrdude can write the chip through its loader, and cannot start what it wrote.
bool starts_the_firmware(const FlashArguments& a) { return a.programmer != "avrdude"; }

void program(const FlashArguments& a) {
    std::vector<std::vector<std::string>> steps;
    if (a.programmer == "avrdude")
        steps = {{"avrdude", "-c", "flip1", "-p", "m32u4", "-U", "flash:w:" + a.image.string() + ":i"}};
    else
        steps = {{"dfu-programmer", "atmega32u4", "erase"},
                 {"dfu-programmer", "atmega32u4", "flash", a.image.string()},
                 {"dfu-programmer", "atmega32u4", "start"}};
    for (const auto& step : steps)
        if (const int status = run(step); status != 0)
            throw DeviceError(fmt::format("{} ended with status {}", fmt::join(step, " "), status),
                              "press the board's bootloader button while you plug it in, and try again");
}

Identity wanted_identity(const FlashArguments& a) {
    Identity identity{};
    identity.layout = identity_layout;
    identity.lamps = static_cast<std::uint8_t>(a.lamps);
    identity.most_lit = static_cast<std::uint8_t>(a.most_lit);
    identity.most_on_ms = static_cast<std::uint16_t>(a.max_on_s * 1000);
    identity.hot = static_cast<std::uint16_t>(a.hot);
    if (a.serial.size() > sizeof identity.serial || a.label.size() > sizeof identity.label)
        throw InputError(fmt::format("a serial has up to {} characters, a label up to {}", sizeof identity.serial,
                                     sizeof identity.label),
                         "shorten it");
    std::memcpy(identity.serial, a.serial.data(), a.serial.size());
    std::memcpy(identity.label, a.label.data(), a.label.size());
    identity.crc = crc16(&identity, offsetof(Identity, crc));
    return identity;
}

/// Leaves the board in its bootloader. None answers when the chip is new, or already there.
bool enter_bootloader(const FlashArguments& a, const ImageMark& mark) {
    const auto boards = UsbBus().boards();
    if (boards.empty()) return false;
    LampControllerOptions options;
    // A board without an identity says "UNSET"; the only one there is is meant then.
    options.serial = boards.size() == 1 && boards.front().serial == "UNSET" ? "" : a.serial;
    LampController board(options);
    const Info info = board.info();
    const int there = info.firmware_major << 8 | info.firmware_minor;
    if ((mark.firmware_major << 8 | mark.firmware_minor) < there && !a.older)
        throw InputError(fmt::format("the board has firmware {}.{}, the image is {}.{}", info.firmware_major,
                                     info.firmware_minor, mark.firmware_major, mark.firmware_minor),
                         "add --older to flash it all the same");
    board.start_bootloader();
    return true;
}

/// Waits for the flashed board; gives it an identity if it has none.
CommandResult check_flashed(const FlashArguments& a, const ImageMark& mark) {
    UsbBus bus;
    bus.open_within("", starts_the_firmware(a) ? restart_patience : reset_patience);
    LampControllerOptions options;
    LampController board(options);
    const Info info = board.info();
    if (info.firmware_major != mark.firmware_major || info.firmware_minor != mark.firmware_minor)
        throw DeviceError(fmt::format("the board came back with firmware {}.{} instead of {}.{}", info.firmware_major,
                                      info.firmware_minor, mark.firmware_major, mark.firmware_minor),
                          "flash it again");
    if (info.lamps == 0) {
        if (a.serial.empty())
            throw InputError("the board is flashed, but has no identity", "run this again with --serial NAME");
        board.store_identity(wanted_identity(a));
    }
    const Identity identity = board.identity();
    const std::string serial = field_text(identity.serial);
    if (!a.serial.empty() && serial != a.serial)
        throw DeviceError(fmt::format("the board calls itself '{}' instead of '{}'", serial, a.serial),
                          "unplug other lamp controllers, and try again");
    CommandResult result;
    result.json = {{"serial", serial},
                   {"label", field_text(identity.label)},
                   {"lamps", identity.lamps},
                   {"firmware", fmt::format("{}.{}", info.firmware_major, info.firmware_minor)}};
    result.text = fmt::format("'{}' runs firmware {}.{} with {} lamps", serial, info.firmware_major,
                              info.firmware_minor, identity.lamps);
    return result;
}

CommandResult flash(const FlashArguments& a) {
    const LampImage image = read_lamp_image(a.image);
    if (UsbBus().boards().size() > 1)
        throw InputError("several lamp controllers are plugged in, and the chip's loader has no name",
                         "unplug all but the one to flash");
    wanted_identity(a);
    enter_bootloader(a, image.mark);
    program(a);
    if (!starts_the_firmware(a))
        fmt::print(stderr, "flashed; now press the board's reset button, or plug it in again\n");
    return check_flashed(a, image.mark);
}

}  // namespace

void add_lamps_flash_command(CommandLine& line, CLI::App& group) {
    const auto a = std::make_shared<FlashArguments>();
    CLI::App& command = line.add(
        "flash", "Flash a USB lamp controller, and give a new one its identity",
        "darkbox lamps flash lamp-controller.hex --serial LC-0042", [a](const WorkContext&) { return flash(*a); },
        &group);
    command.add_option("image", a->image, "The firmware, Intel HEX")->required();
    command.add_option("--serial", a->serial, "The board, or what a new one is to be called");
    command.add_option("--label", a->label, "Of a new board: the rig it belongs to");
    command.add_option("--lamps", a->lamps, "Of a new board: its outputs")->check(CLI::Range(1, 64));
    command.add_option("--most-lit", a->most_lit, "Of a new board: lamps lit at once that its supply bears")
        ->check(CLI::Range(1, 8));
    command.add_option("--max-on-s", a->max_on_s, "Of a new board: the longest that any lamp may be lit")
        ->check(CLI::Range(0.001, 60.0));
    command.add_option("--hot", a->hot, "Of a new board: thermistor readings below are too hot")
        ->check(CLI::Range(1, 900));
    command.add_option("--programmer", a->programmer, "What writes the chip")
        ->check(CLI::IsMember({"dfu-programmer", "avrdude"}));
    command.add_flag("--older", a->older, "Flash an older firmware than the board has");
}

}  // namespace darkbox
