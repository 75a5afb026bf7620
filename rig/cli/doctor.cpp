#include "rig/cli/doctor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>

#include "acquisition/device/unique_fd.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

std::string listed(const std::vector<fs::path>& paths) {
    std::vector<std::string> names;
    for (const fs::path& path : paths) names.push_back(path.string());
    return fmt::format("{}", fmt::join(names, ", "));
}

/// The lines that the rig's lamps hang on, as rig.toml names them.
std::vector<std::string> lines_of(const RigDescription& rig) {
    std::vector<std::string> lines;
    if (const auto& multiplexer = rig.gpio.multiplexer) {
        lines = multiplexer->address_lines;
        lines.push_back(multiplexer->enable_line);
        return lines;
    }
    for (const LampDescription& lamp : rig.lamps) lines.push_back(lamp.line);
    return lines;
}

/// By name, or by number where it has none.
const GpioLineSeen* find_line(const GpioChipSeen& chip, const std::string& line) {
    const auto named = std::ranges::find(chip.lines, line, &GpioLineSeen::name);
    if (named != chip.lines.end()) return &*named;
    std::size_t offset = 0;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), offset);
    if (error != std::errc() || end != line.data() + line.size() || offset >= chip.lines.size()) return nullptr;
    return &chip.lines[offset];
}

Diagnosis diagnose_line(const GpioChipSeen& chip, const std::string& line) {
    const std::string subject = fmt::format("line {} of {}", line, chip.label);
    const GpioLineSeen* seen = find_line(chip, line);
    if (seen == nullptr)
        return {subject, Verdict::bad, "there is no such line",
                fmt::format("gpioinfo {} lists its lines; correct rig.toml", chip.device.filename().string())};
    if (seen->holder.empty()) return {subject, Verdict::good, "free"};
    if (seen->holder.starts_with("darkbox")) return {subject, Verdict::good, "held by darkboxd"};
    return {subject, Verdict::bad, fmt::format("held by \"{}\"", seen->holder),
            fmt::format("stop that program (sudo fuser -v {} names it; for a kernel driver remove its overlay), or "
                        "choose another line in rig.toml",
                        chip.device.string())};
}

Diagnosis no_such_chip(const RigDescription& rig, const MachineSeen& machine) {
    std::vector<std::string> known;
    for (const GpioChipSeen& chip : machine.chips) known.push_back(chip.label.empty() ? "?" : chip.label);
    if (known.empty())
        return {"GPIO", Verdict::bad, "this machine has no GPIO chip (/dev/gpiochip*)",
                "load the driver of the board or adapter, or plug it in; dmesg | grep -i gpio tells"};
    return {"GPIO", Verdict::bad, fmt::format("there is no chip with the label \"{}\"", rig.gpio.chip),
            fmt::format("set [lamps.gpio] chip to one of: {}", fmt::join(known, ", "))};
}

double megabytes_per_second(std::size_t bytes, std::chrono::steady_clock::time_point start) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return static_cast<double>(bytes) / 1e6 / std::max(seconds, 1e-6);
}

}  // namespace

std::string join_group(const MachineSeen& machine, const std::string& group) {
    if (std::ranges::find(machine.groups, group) != machine.groups.end())
        return fmt::format("you are in the group {} already: look at the device's mode with ls -l", group);
    return fmt::format("sudo usermod -aG {} {}, then log in again", group, machine.user);
}

Diagnoses diagnose_camera(const RigDescription& rig, const MachineSeen& machine) {
    if (rig.camera.driver == "sim") return {{"camera", Verdict::good, "simulated"}};
    const std::string subject = "camera " + rig.camera.device;
    switch (machine.camera) {
        case Access::open:
            return {{subject, Verdict::good, "there, and open to " + machine.user}};
        case Access::denied:
            return {
                {subject, Verdict::bad, fmt::format("there, but {} may not use it", machine.user),
                 machine.camera_group != "root" ? join_group(machine, machine.camera_group)
                 : machine.udev_rules
                     ? "it belongs to root alone: sudo udevadm trigger gives it to the group video; then " +
                           join_group(machine, "video")
                     : "it belongs to root alone: install darkbox-daemon, whose udev rule gives cameras to the group "
                       "video; then " +
                           join_group(machine, "video")}};
        case Access::absent:
            break;
    }
    if (machine.cameras.empty())
        return {{subject, Verdict::bad, "no camera is plugged in (no /dev/video*)",
                 "plug it in; lsusb must show it, and lsmod | grep uvcvideo its driver (sudo modprobe uvcvideo)"}};
    return {{subject, Verdict::bad, "this camera is not there",
             fmt::format("set [camera] device in rig.toml to one of: {}", listed(machine.cameras))}};
}

Diagnoses diagnose_lamps(const RigDescription& rig, const MachineSeen& machine) {
    if (rig.lamps_driver == "sim") return {{"lamps", Verdict::good, "simulated"}};
    if (rig.lamps_driver != "gpio") return diagnose_usb_lamps(rig, machine);
    const auto chip = std::ranges::find(machine.chips, rig.gpio.chip, &GpioChipSeen::label);
    if (chip == machine.chips.end()) {
        const auto closed = std::ranges::find(machine.chips, Access::denied, &GpioChipSeen::access);
        if (closed == machine.chips.end()) return {no_such_chip(rig, machine)};
        return {{"GPIO", Verdict::bad, fmt::format("{} may not open {}", machine.user, closed->device.string()),
                 machine.udev_rules ? join_group(machine, "darkbox")
                                    : "install darkbox-daemon, whose udev rule gives the chips to the group darkbox"}};
    }
    Diagnoses all{{"GPIO", Verdict::good, fmt::format("{} is {}", chip->label, chip->device.string())}};
    for (const std::string& line : lines_of(rig)) all.push_back(diagnose_line(*chip, line));
    return all;
}

Diagnoses diagnose_disk(const RigDescription& rig, const fs::path& sessions) {
    const std::string subject = "disk of " + sessions.string();
    std::error_code error;
    fs::create_directories(sessions, error);
    if (error)
        return {{subject, Verdict::bad, "the folder cannot be made: " + error.message(),
                 fmt::format("sudo install -d -o $USER {}", sessions.string())}};
    constexpr std::size_t piece = 4 << 20;
    constexpr std::size_t pieces = 8;
    const fs::path file = sessions / ".darkbox-doctor";
    const auto start = std::chrono::steady_clock::now();
    const UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    bool written = static_cast<bool>(fd);
    const std::vector<char> bytes(piece, 'x');
    for (std::size_t i = 0; i < pieces && written; ++i)
        written = ::write(fd.get(), bytes.data(), piece) == static_cast<ssize_t>(piece);
    written = written && ::fsync(fd.get()) == 0;
    const int reason = errno;
    const double speed = megabytes_per_second(piece * pieces, start);
    ::unlink(file.c_str());
    if (!written)
        return {{subject, Verdict::bad, fmt::format("cannot be written: {}", std::strerror(reason)),
                 reason == ENOSPC ? "free space there" : fmt::format("sudo chown -R $USER {}", sessions.string())}};
    Diagnoses all{{subject, Verdict::good, fmt::format("writes {:.0f} MB/s, flushed", speed)}};
    const double wanted = camera_megabytes_per_second(rig);
    if (wanted > speed)
        all.push_back({subject, Verdict::warning, fmt::format("the camera sends {:.0f} MB/s", wanted),
                       "captures will wait for the disk: use a faster one for [api] sessions"});
    const double free = static_cast<double>(fs::space(sessions, error).available) / 1e9;
    constexpr double little = 5;  // GB
    if (free < little)
        all.push_back({subject, Verdict::warning, fmt::format("{:.1f} GB are free", free),
                       "free space there, or choose another disk under [api] sessions"});
    return all;
}

}  // namespace darkbox
