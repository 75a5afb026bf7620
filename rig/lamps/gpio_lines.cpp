#include "rig/lamps/gpio_lines.h"

#include <fmt/format.h>
#include <gpiod.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "acquisition/device/device_error.h"

// libgpiod's two generations share no call but a few names, so each has its own Chip and HeldLines below; everything
// else here is written once. CMake defines DARKBOX_LIBGPIOD from the version that pkg-config finds.

namespace darkbox {
namespace {

constexpr const char* consumer = "darkbox";

using Offsets = std::vector<unsigned int>;
using Levels = std::vector<int>;  ///< 1 = electrically high

#if DARKBOX_LIBGPIOD == 1

struct CloseChip {
    void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

class Chip {
public:
    /// No value, and errno, where `path` cannot be opened or is no GPIO chip.
    static std::optional<Chip> open(const std::string& path) {
        gpiod_chip* chip = gpiod_chip_open(path.c_str());
        return chip == nullptr ? std::nullopt : std::optional(Chip(chip));
    }

    std::string label() const { return gpiod_chip_label(chip_.get()); }
    unsigned int line_count() const { return gpiod_chip_num_lines(chip_.get()); }

    std::optional<unsigned int> offset_of(const std::string& name) const {
        gpiod_line* line = gpiod_chip_find_line(chip_.get(), name.c_str());
        return line == nullptr ? std::nullopt : std::optional(gpiod_line_offset(line));
    }

    /// Empty where nobody holds the line.
    std::string holder_of(unsigned int offset) const {
        gpiod_line* line = gpiod_chip_get_line(chip_.get(), offset);
        if (line == nullptr || !gpiod_line_is_used(line)) return "";
        const char* name = gpiod_line_consumer(line);
        return name == nullptr ? "the kernel" : name;
    }

private:
    friend class HeldLines;
    explicit Chip(gpiod_chip* chip) : chip_(chip) {}

    std::unique_ptr<gpiod_chip, CloseChip> chip_;
};

class HeldLines {
public:
    /// No value, and errno, where the kernel refuses.
    static std::optional<HeldLines> request(Chip& chip, const Offsets& offsets, const Levels& levels) {
        HeldLines held;
        gpiod_line_bulk_init(&held.lines_);
        for (const unsigned int offset : offsets) {
            gpiod_line* line = gpiod_chip_get_line(chip.chip_.get(), offset);
            if (line == nullptr) return std::nullopt;
            gpiod_line_bulk_add(&held.lines_, line);
        }
        if (gpiod_line_request_bulk_output(&held.lines_, consumer, levels.data()) != 0) return std::nullopt;
        held.chip_ = std::move(chip.chip_);
        return held;
    }

    static std::optional<HeldLines> request_input(Chip& chip, unsigned int offset) {
        HeldLines held;
        gpiod_line_bulk_init(&held.lines_);
        gpiod_line* line = gpiod_chip_get_line(chip.chip_.get(), offset);
        if (line == nullptr || gpiod_line_request_input(line, consumer) != 0) return std::nullopt;
        gpiod_line_bulk_add(&held.lines_, line);
        held.chip_ = std::move(chip.chip_);
        return held;
    }

    bool set(const Levels& levels) { return gpiod_line_set_value_bulk(&lines_, levels.data()) == 0; }
    /// Of the only line; below 0 and errno where it cannot be read.
    int level() { return gpiod_line_get_value(gpiod_line_bulk_get_line(&lines_, 0)); }

private:
    std::unique_ptr<gpiod_chip, CloseChip> chip_;  // closing it releases its lines
    gpiod_line_bulk lines_{};
};

#else

template <auto Release>
struct ReleaseBy {
    template <typename T>
    void operator()(T* held) const {
        Release(held);
    }
};

class Chip {
public:
    static std::optional<Chip> open(const std::string& path) {
        gpiod_chip* chip = gpiod_is_gpiochip_device(path.c_str()) ? gpiod_chip_open(path.c_str()) : nullptr;
        if (chip == nullptr) return std::nullopt;
        gpiod_chip_info* info = gpiod_chip_get_info(chip);
        if (info == nullptr) {
            gpiod_chip_close(chip);
            return std::nullopt;
        }
        Chip opened(chip, gpiod_chip_info_get_label(info),
                    static_cast<unsigned int>(gpiod_chip_info_get_num_lines(info)));
        gpiod_chip_info_free(info);
        return opened;
    }

    const std::string& label() const { return label_; }
    unsigned int line_count() const { return line_count_; }

    std::optional<unsigned int> offset_of(const std::string& name) const {
        const int offset = gpiod_chip_get_line_offset_from_name(chip_.get(), name.c_str());
        return offset < 0 ? std::nullopt : std::optional(static_cast<unsigned int>(offset));
    }

    std::string holder_of(unsigned int offset) const {
        const std::unique_ptr<gpiod_line_info, ReleaseBy<gpiod_line_info_free>> info(
            gpiod_chip_get_line_info(chip_.get(), offset));
        if (!info || !gpiod_line_info_is_used(info.get())) return "";
        const char* name = gpiod_line_info_get_consumer(info.get());
        return name == nullptr ? "the kernel" : name;
    }

private:
    friend class HeldLines;
    Chip(gpiod_chip* chip, std::string label, unsigned int line_count)
        : chip_(chip), label_(std::move(label)), line_count_(line_count) {}

    std::unique_ptr<gpiod_chip, ReleaseBy<gpiod_chip_close>> chip_;
    std::string label_;
    unsigned int line_count_;
};

class HeldLines {
public:
    static std::optional<HeldLines> request(Chip& chip, const Offsets& offsets, const Levels& levels) {
        const std::unique_ptr<gpiod_line_settings, ReleaseBy<gpiod_line_settings_free>> settings(
            gpiod_line_settings_new());
        const std::unique_ptr<gpiod_line_config, ReleaseBy<gpiod_line_config_free>> lines(gpiod_line_config_new());
        const std::unique_ptr<gpiod_request_config, ReleaseBy<gpiod_request_config_free>> request(
            gpiod_request_config_new());
        if (!settings || !lines || !request) return std::nullopt;
        if (gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_OUTPUT) != 0) return std::nullopt;
        gpiod_request_config_set_consumer(request.get(), consumer);
        for (std::size_t i = 0; i < offsets.size(); ++i) {
            if (gpiod_line_settings_set_output_value(settings.get(), value(levels[i])) != 0 ||
                gpiod_line_config_add_line_settings(lines.get(), &offsets[i], 1, settings.get()) != 0)
                return std::nullopt;
        }
        HeldLines held;
        held.offsets_ = offsets;
        held.request_.reset(gpiod_chip_request_lines(chip.chip_.get(), request.get(), lines.get()));
        return held.request_ ? std::optional(std::move(held)) : std::nullopt;
    }

    static std::optional<HeldLines> request_input(Chip& chip, unsigned int offset) {
        const std::unique_ptr<gpiod_line_settings, ReleaseBy<gpiod_line_settings_free>> settings(
            gpiod_line_settings_new());
        const std::unique_ptr<gpiod_line_config, ReleaseBy<gpiod_line_config_free>> lines(gpiod_line_config_new());
        const std::unique_ptr<gpiod_request_config, ReleaseBy<gpiod_request_config_free>> request(
            gpiod_request_config_new());
        if (!settings || !lines || !request ||
            gpiod_line_settings_set_direction(settings.get(), GPIOD_LINE_DIRECTION_INPUT) != 0 ||
            gpiod_line_config_add_line_settings(lines.get(), &offset, 1, settings.get()) != 0)
            return std::nullopt;
        gpiod_request_config_set_consumer(request.get(), consumer);
        HeldLines held;
        held.offsets_ = {offset};
        held.request_.reset(gpiod_chip_request_lines(chip.chip_.get(), request.get(), lines.get()));
        return held.request_ ? std::optional(std::move(held)) : std::nullopt;
    }

    int level() {
        const gpiod_line_value read = gpiod_line_request_get_value(request_.get(), offsets_.front());
        return read == GPIOD_LINE_VALUE_ERROR ? -1 : read == GPIOD_LINE_VALUE_ACTIVE ? 1 : 0;
    }

    bool set(const Levels& levels) {
        std::vector<gpiod_line_value> values;
        for (const int level : levels) values.push_back(value(level));
        return gpiod_line_request_set_values_subset(request_.get(), offsets_.size(), offsets_.data(), values.data()) ==
               0;
    }

private:
    static gpiod_line_value value(int level) {
        return level == 0 ? GPIOD_LINE_VALUE_INACTIVE : GPIOD_LINE_VALUE_ACTIVE;
    }

    std::unique_ptr<gpiod_line_request, ReleaseBy<gpiod_line_request_release>> request_;
    Offsets offsets_;
};

#endif

std::string reason(int error_number) { return std::generic_category().message(error_number); }

Chip open_chip(const std::string& label) {
    std::vector<std::string> others;
    std::string unreadable;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
        const std::string path = entry.path().string();
        if (!path.starts_with("/dev/gpiochip")) continue;
        auto chip = Chip::open(path);
        if (!chip) {
            unreadable = fmt::format("{}: {}", path, reason(errno));
            continue;
        }
        if (chip->label() == label) return std::move(*chip);
        others.push_back(chip->label());
    }
    if (!unreadable.empty() && others.empty())
        throw DeviceError(fmt::format("GPIO chip \"{}\" cannot be looked for: {}", label, unreadable),
                          "let this user open it: see its group in ls -l /dev/gpiochip*");
    std::sort(others.begin(), others.end());
    throw DeviceError(fmt::format("there is no GPIO chip with the label \"{}\"", label),
                      others.empty() ? "there is no GPIO chip at all: plug it in, or load its driver"
                                     : fmt::format("plug it in, or name one of these as chip under [lamps.gpio]: {}",
                                                   fmt::join(others, ", ")));
}

unsigned int find_line(const Chip& chip, const GpioRequest& request, const std::string& line) {
    if (const auto offset = chip.offset_of(line)) return *offset;
    const bool digits = !line.empty() && line.size() < 6 && line.find_first_not_of("0123456789") == std::string::npos;
    if (!digits)
        throw DeviceError(fmt::format("GPIO chip \"{}\" has no line named \"{}\"", request.chip, line),
                          "gpioinfo lists the names; a line without a name is given by its offset");
    const auto offset = static_cast<unsigned int>(std::stoul(line));
    if (offset >= chip.line_count())
        throw DeviceError(fmt::format("GPIO chip \"{}\" has no line {}: it has lines 0 to {}", request.chip, line,
                                      chip.line_count() - 1),
                          "correct the line in rig.toml");
    return offset;
}

/// Polarity is applied here: the kernel of libgpiod 1.6 has one for a whole request.
int level(bool active, const GpioLine& line) { return active != line.active_low ? 1 : 0; }

[[noreturn]] void refuse(const Chip& chip, const GpioRequest& request, const Offsets& offsets, int error_number) {
    if (error_number == EBUSY) {
        for (std::size_t i = 0; i < offsets.size(); ++i) {
            const std::string holder = chip.holder_of(offsets[i]);
            if (holder.empty()) continue;
            throw DeviceError(fmt::format("line {} of GPIO chip \"{}\" is held by \"{}\"", request.lines[i].line,
                                          request.chip, holder),
                              fmt::format("stop {}, or wire the lamp to a free line (gpioinfo shows them)",
                                          holder == consumer ? "the other darkbox program, or the unit darkbox-guardian"
                                                             : "what holds it"));
        }
    }
    throw_errno("request lines of GPIO chip", fmt::format("\"{}\"", request.chip), error_number);
}

class KernelLines final : public OutputLines {
public:
    KernelLines(GpioRequest request, HeldLines held) : request_(std::move(request)), held_(std::move(held)) {}

    void set(const std::vector<bool>& active) override {
        Levels levels;
        for (std::size_t i = 0; i < request_.lines.size(); ++i)
            levels.push_back(level(active.at(i), request_.lines[i]));
        if (!held_.set(levels)) throw_errno("set lines of GPIO chip", fmt::format("\"{}\"", request_.chip), errno);
    }

private:
    GpioRequest request_;
    HeldLines held_;
};

class KernelInput final : public InputLine {
public:
    KernelInput(std::string chip, GpioLine line, HeldLines held)
        : chip_(std::move(chip)), line_(std::move(line)), held_(std::move(held)) {}

    bool active() override {
        const int read = held_.level();
        if (read < 0)
            throw_errno(fmt::format("read line {} of GPIO chip", line_.line), fmt::format("\"{}\"", chip_), errno);
        return (read == 1) != line_.active_low;
    }

private:
    std::string chip_;
    GpioLine line_;
    HeldLines held_;
};

}  // namespace

std::unique_ptr<InputLine> request_gpio_input(const std::string& label, const GpioLine& line) {
    Chip chip = open_chip(label);
    const GpioRequest request{label, {line}};
    const unsigned int offset = find_line(chip, request, line.line);
    auto held = HeldLines::request_input(chip, offset);
    if (!held) refuse(chip, request, {offset}, errno);
    return std::make_unique<KernelInput>(label, line, std::move(*held));
}

std::unique_ptr<OutputLines> request_gpio_lines(const GpioRequest& request) {
    Chip chip = open_chip(request.chip);
    Offsets offsets;
    Levels levels;
    for (const GpioLine& line : request.lines) {
        const unsigned int offset = find_line(chip, request, line.line);
        const auto earlier = std::find(offsets.begin(), offsets.end(), offset);
        if (earlier != offsets.end())
            throw DeviceError(fmt::format("\"{}\" and \"{}\" are the same line of GPIO chip \"{}\"",
                                          request.lines[static_cast<std::size_t>(earlier - offsets.begin())].line,
                                          line.line, request.chip),
                              "give every lamp a line of its own");
        offsets.push_back(offset);
        levels.push_back(level(false, line));
    }
    auto held = HeldLines::request(chip, offsets, levels);
    if (!held) refuse(chip, request, offsets, errno);
    return std::make_unique<KernelLines>(request, std::move(*held));
}

}  // namespace darkbox
