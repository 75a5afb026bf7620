#include "tests/hil/usb_board.h"

#include <fmt/format.h>
#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/hil/machine.h"

namespace darkbox::test {

namespace fs = std::filesystem;

namespace {

constexpr const char* product = "darkbox lamp controller\n";

std::vector<std::string> board_command(const fs::path& record, const fs::path& strobe) {
    std::vector<std::string> words{program("usb_lamp_board"), "--elf",    DARKBOX_LAMP_ELF, "--seen",
                                   record.string(),           "--serial", UsbBoard::serial};
    if (!strobe.empty()) words.insert(words.end(), {"--strobe", strobe.string()});
    return words;
}

/// Whole lines of "when lit level".
std::vector<std::uint64_t> recorded(const fs::path& record) {
    std::vector<std::uint64_t> lit;
    std::ifstream in(record);
    for (std::string line; std::getline(in, line) && !in.eof();) {
        std::istringstream words(line);
        std::string when;
        std::uint64_t lamps = 0;
        if (words >> when >> std::hex >> lamps) lit.push_back(lamps);
    }
    return lit;
}

}  // namespace

UsbBoard::UsbBoard(const fs::path& folder, const fs::path& strobe)
    : record_(folder / "lamps.txt"), process_(board_command(record_, strobe), folder / "board") {
    if (!comes_true([&] { return !node().empty(); }))
        throw std::runtime_error("the lamp controller does not appear: " + process_.err());
}

void UsbBoard::pull_cable() {
    process_.signal(SIGUSR1);
    if (!comes_true([&] { return node().empty(); })) throw std::runtime_error("the board stays plugged in");
}

void UsbBoard::plug_cable() {
    process_.signal(SIGUSR2);
    if (!comes_true([&] { return !node().empty(); })) throw std::runtime_error("the board does not come back");
}

void UsbBoard::hang() { process_.signal(SIGHUP); }

std::string UsbBoard::node() const {
    for (const auto& entry : fs::directory_iterator("/sys/bus/usb/devices")) {
        if (text_of(entry.path() / "product") != product) continue;
        const std::string bus = text_of(entry.path() / "busnum"), device = text_of(entry.path() / "devnum");
        if (bus.empty() || device.empty()) continue;
        const std::string found = fmt::format("/dev/bus/usb/{:03}/{:03}", std::stoi(bus), std::stoi(device));
        if (fs::exists(found)) return found;
    }
    return {};
}

std::uint64_t UsbBoard::lit() const {
    const std::vector<std::uint64_t> all = recorded(record_);
    return all.empty() ? 0 : all.back();
}

std::vector<std::uint64_t> UsbBoard::history() const {
    std::vector<std::uint64_t> all = recorded(record_);
    std::erase(all, 0U);
    return all;
}

std::string UsbBoard::unplug() {
    process_.signal(SIGTERM);
    if (const int status = process_.wait(); status != 0) throw std::runtime_error("the board: " + process_.err());
    return process_.out();
}

}  // namespace darkbox::test
