#include "tests/hil/gpio_chip.h"

#include <fmt/format.h>

#include <sstream>
#include <stdexcept>

#include "tests/hil/machine.h"

namespace darkbox::test {

namespace fs = std::filesystem;

namespace {

std::string word_of(const fs::path& file) {
    std::string word;
    std::istringstream(text_of(file)) >> word;
    return word;
}

fs::path line_folder(const fs::path& config, unsigned int offset) {
    const fs::path folder = config / "bank" / fmt::format("line{}", offset);
    fs::create_directories(folder);
    return folder;
}

}  // namespace

GpioChip::GpioChip(std::string label, const Lines& lines) : label_(std::move(label)), count_(lines.count) {
    fs::create_directory(config());
    fs::create_directory(config() / "bank");
    put(std::to_string(count_), config() / "bank/num_lines");
    put(label_, config() / "bank/label");
    for (const auto& [offset, name] : lines.names) put(name, line_folder(config(), offset) / "name");
    for (const auto& [offset, holder] : lines.hogs) {
        const fs::path hog = line_folder(config(), offset) / "hog";
        fs::create_directory(hog);
        put(holder, hog / "name");
        put("output-low", hog / "direction");
    }
    plug();
}

/// configfs takes folders away one by one, the innermost first.
GpioChip::~GpioChip() {
    shell("echo 0 > " + (config() / "live").string());
    shell("find " + config().string() + " -depth -type d -exec rmdir {} +");
}

void GpioChip::plug() { put("1", config() / "live"); }
void GpioChip::unplug() { put("0", config() / "live"); }

void GpioChip::pull_up(unsigned int offset) const {
    put("pull-up", folder() / fmt::format("sim_gpio{}", offset) / "pull");
}

bool GpioChip::is_high(unsigned int offset) const {
    return word_of(folder() / fmt::format("sim_gpio{}", offset) / "value") == "1";
}

std::vector<unsigned int> GpioChip::high_lines() const {
    std::vector<unsigned int> high;
    for (unsigned int offset = 0; offset < count_; ++offset)
        if (is_high(offset)) high.push_back(offset);
    return high;
}

fs::path GpioChip::folder() const {
    return fs::path("/sys/devices/platform") / word_of(config() / "dev_name") / word_of(config() / "bank/chip_name");
}

unsigned int GpioChip::first_number() const {
    const std::string chip = word_of(config() / "bank/chip_name") + ": GPIOs ";
    const std::string all = text_of("/sys/kernel/debug/gpio");
    const std::size_t found = all.find(chip);
    if (found == std::string::npos) throw std::runtime_error("the kernel does not tell the numbers of " + label_);
    return static_cast<unsigned int>(std::stoul(all.substr(found + chip.size())));
}

fs::path GpioChip::config() const { return fs::path("/sys/kernel/config/gpio-sim") / label_; }

}  // namespace darkbox::test
