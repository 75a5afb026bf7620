#include "tests/firmware/emulator/emulated_board.h"

extern "C" {
#include <avr_adc.h>
#include <avr_eeprom.h>
#include <avr_ioport.h>
#include <avr_usb.h>
#include <sim_avr.h>
#include <sim_cycle_timers.h>
#include <sim_elf.h>
#include <sim_io.h>
}

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "firmware/board/atmega32u4/eeprom_layout.h"

namespace darkbox::test {
namespace {

// The chip's registers, as addresses in data memory.
constexpr unsigned ddr_b = 0x24, port_b = 0x25, ddr_c = 0x27, port_c = 0x28, spcr = 0x4C, spsr = 0x4D, spdr = 0x4E,
                   mcusr = 0x54, tccr3a = 0x90, ocr3a = 0x98, usbsta = 0xD9, usbint = 0xDA, udcon = 0xE0, udint = 0xE1,
                   ueintx = 0xE8, uenum = 0xE9;
constexpr unsigned latch = 1 << 0, supply = 1 << 4;       // port B
constexpr unsigned blank = 1 << 6, trigger_bit = 1 << 7;  // port C
constexpr unsigned spif = 1 << 7, spi2x = 1 << 0;
constexpr unsigned pwm_on_pin = 3 << 6;  // COM3A1:0
constexpr std::uint8_t brown_out_flag = 1 << 2;
constexpr std::uint16_t jump_to_itself = 0xCFFF;
constexpr std::uint32_t bootloader = 0x7000;
constexpr unsigned bytes_not_initialised = 5;  ///< .noinit, which lies behind .bss
constexpr std::uint8_t paint = 0xC5;
constexpr std::uint8_t anything[8] = {0xA5, 0x3C, 0xFF, 0x01, 0x80, 0x5A, 0x77, 0xEE};  ///< as registers wake up

void log_errors_alone(avr_t*, const int level, const char* format, va_list arguments) {
    if (level <= LOG_ERROR) std::vfprintf(stderr, format, arguments);
}

}  // namespace

struct EmulatedBoard::Simulator {
    avr_t* avr = nullptr;
    elf_firmware_t image{};
    std::vector<std::uint8_t> shifted{anything, anything + 8};
    std::array<std::uint8_t, 8> latched{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
    std::uint8_t last_port_b = 0;
    std::array<std::uint8_t, 6> pins_seen{};
    std::uint8_t sending = 0;
    unsigned first_free = 0;
    std::optional<std::uint32_t> hung_at;
    std::uint16_t instruction_there = 0;
    std::uint32_t last_pc = 0;

    std::uint8_t reg(unsigned address) const { return avr->data[address]; }

    /// What the pins are made of.
    std::array<std::uint8_t, 6> pin_registers() const {
        return {reg(ddr_b), reg(port_b), reg(ddr_c), reg(port_c), reg(tccr3a), reg(ocr3a)};
    }

    void take_over_spi() {
        auto& io = avr->io[AVR_DATA_TO_IO(spdr)];
        io.w.param = this;
        io.w.c = [](avr_t* a, avr_io_addr_t address, std::uint8_t value, void* self) {
            static constexpr unsigned divisors[] = {4, 16, 64, 128};
            const unsigned divisor = divisors[a->data[spcr] & 3] / ((a->data[spsr] & spi2x) != 0 ? 2 : 1);
            a->data[address] = value;
            static_cast<Simulator*>(self)->sending = value;
            a->data[spsr] = static_cast<std::uint8_t>(a->data[spsr] & ~spif);
            avr_cycle_timer_register(a, 8 * divisor, byte_sent, self);
        };
    }
    static avr_cycle_count_t byte_sent(avr_t* a, avr_cycle_count_t, void* self) {
        a->data[spsr] = static_cast<std::uint8_t>(a->data[spsr] | spif);
        auto& shifted = static_cast<Simulator*>(self)->shifted;
        shifted.push_back(static_cast<Simulator*>(self)->sending);
        shifted.erase(shifted.begin());
        return 0;
    }

    std::uint8_t endpoint_flags(std::uint8_t endpoint) const {
        const std::uint8_t before = avr->data[uenum];
        avr->data[uenum] = endpoint;
        auto& io = avr->io[AVR_DATA_TO_IO(ueintx)].r;
        const std::uint8_t flags = io.c(avr, ueintx, io.param);
        avr->data[uenum] = before;
        return flags;
    }

    Handshake transfer(std::uint32_t request, std::uint8_t endpoint, std::uint8_t* bytes, std::uint32_t& size) {
        avr_io_usb packet{endpoint, size, bytes};
        const int result = avr_ioctl(avr, request, &packet);
        size = packet.sz;
        if (result == AVR_IOCTL_USB_OK) return Handshake::ack;
        if (result == AVR_IOCTL_USB_NAK) return Handshake::nak;
        return result == AVR_IOCTL_USB_STALL ? Handshake::stall : Handshake::error;
    }
};

EmulatedBoard::EmulatedBoard(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity)
    : chip_(std::make_unique<Simulator>()) {
    avr_global_logger_set(log_errors_alone);
    if (elf_read_firmware(elf.c_str(), &chip_->image) != 0)
        throw std::runtime_error("no firmware image at " + elf.string());
    chip_->avr = avr_make_mcu_by_name("atmega32u4");
    if (chip_->avr == nullptr) throw std::runtime_error("this simavr has no atmega32u4");
    avr_t& avr = *chip_->avr;
    avr_init(&avr);
    chip_->image.frequency = 16'000'000;
    chip_->image.vcc = chip_->image.avcc = chip_->image.aref = 5000;
    avr_load_firmware(&avr, &chip_->image);
    avr.flashend = 0x7FFF;
    avr.log = LOG_ERROR;
    avr.sleep = [](avr_t*, avr_cycle_count_t) {};  // emulated time only
    chip_->take_over_spi();
    chip_->first_free = 0x100 + chip_->image.datasize + chip_->image.bsssize + bytes_not_initialised;
    std::memset(avr.data + chip_->first_free, paint, avr.ramend - chip_->first_free + 1);
    if (identity) {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(&*identity);
        write_eeprom(board::identity_address, {bytes, bytes + sizeof *identity});
    }
    set_thermistor(512);
    look();
}

EmulatedBoard::~EmulatedBoard() { avr_terminate(chip_->avr); }

std::uint64_t EmulatedBoard::cycle() const { return chip_->avr->cycle; }

void EmulatedBoard::step() {
    if (in_bootloader()) {  // the chip's own loader is not here; time passes in it
        chip_->avr->cycle += cycles_per_us;
        return;
    }
    const int state = avr_run(chip_->avr);
    if (state == cpu_Done || state == cpu_Crashed) throw std::runtime_error("the emulated chip stopped");
    const std::uint32_t pc = chip_->avr->pc;
    if (pc == 0 && chip_->last_pc != 0) {
        ++resets_;
        if (chip_->hung_at) {
            std::memcpy(chip_->avr->flash + *chip_->hung_at, &chip_->instruction_there, 2);
            chip_->hung_at.reset();
        }
    }
    chip_->last_pc = pc;
    look();
}

/// simavr raises no event for every change, and none at a reset: so the pins are looked at after each instruction.
void EmulatedBoard::look() {
    Simulator& c = *chip_;
    const auto pins = c.pin_registers();
    if (pins == c.pins_seen) return;
    c.pins_seen = pins;
    const std::uint8_t b = c.reg(port_b);
    if ((b & latch) != 0 && (c.last_port_b & latch) == 0)
        std::reverse_copy(c.shifted.begin(), c.shifted.end(), c.latched.begin());
    c.last_port_b = b;

    LampsSeen now;
    const bool driven = (c.reg(ddr_c) & blank) != 0;  // else the pull-up blanks
    const bool pwm = (c.reg(tccr3a) & pwm_on_pin) == pwm_on_pin;
    if (driven && supply_on()) now.level = pwm ? c.reg(ocr3a) + 1U : (c.reg(port_c) & blank) == 0 ? 255U : 0U;
    if (now.level != 0)
        for (unsigned i = 0; i < 8; ++i) now.lit |= std::uint64_t{c.latched[i]} << 8 * i;
    if (now.lit == 0) now.level = 0;
    if (now != seen_) {
        seen_ = now;
        if (on_lamps) on_lamps(seen_);
    }
    const bool trigger = (c.reg(ddr_c) & trigger_bit) != 0 && (c.reg(port_c) & trigger_bit) != 0;
    if (trigger != trigger_) {
        trigger_ = trigger;
        if (on_trigger) on_trigger(trigger);
    }
}

void EmulatedBoard::run_us(double microseconds) {
    const std::uint64_t end = cycle() + static_cast<std::uint64_t>(microseconds * cycles_per_us);
    while (cycle() < end) step();
}

bool EmulatedBoard::run_until(const std::function<bool()>& holds, double most_ms) {
    const std::uint64_t end = cycle() + static_cast<std::uint64_t>(most_ms * 1000 * cycles_per_us);
    while (!holds()) {
        if (cycle() >= end) return false;
        step();
    }
    return true;
}

bool EmulatedBoard::supply_on() const {
    return (chip_->reg(ddr_b) & supply) != 0 && (chip_->reg(port_b) & supply) != 0;
}

bool EmulatedBoard::attached() const { return (chip_->reg(0xD8) & 0x80) != 0 && (chip_->reg(udcon) & 1) == 0; }

bool EmulatedBoard::in_bootloader() const { return chip_->avr->pc >= bootloader; }

void EmulatedBoard::set_thermistor(std::uint16_t reading) {
    constexpr std::uint32_t full_scale_mv = 5000;
    avr_raise_irq(avr_io_getirq(chip_->avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC4),
                  (reading * full_scale_mv + 1023) / 1024);
}

void EmulatedBoard::set_strobe(bool active) {
    avr_raise_irq(avr_io_getirq(chip_->avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 0), active ? 1 : 0);
}

void EmulatedBoard::hang(Interrupts interrupts) {
    avr_t& avr = *chip_->avr;
    chip_->hung_at = avr.pc;
    std::memcpy(&chip_->instruction_there, avr.flash + avr.pc, 2);
    std::memcpy(avr.flash + avr.pc, &jump_to_itself, 2);
    if (avr.state == cpu_Sleeping) avr.state = cpu_Running;
    if (interrupts == Interrupts::off) avr.sreg[S_I] = 0;
}

void EmulatedBoard::brown_out() {
    avr_reset(chip_->avr);
    chip_->avr->data[mcusr] = brown_out_flag;
    ++resets_;
    chip_->last_pc = 0;
    std::copy_n(anything, 8, chip_->latched.begin());
    chip_->pins_seen.fill(0xFF);  // other registers behind the same pins
    look();
}

void EmulatedBoard::signal_suspend() { chip_->avr->data[udint] |= 1; }

void EmulatedBoard::signal_unplug() {
    chip_->avr->data[usbsta] &= static_cast<std::uint8_t>(~1U);
    chip_->avr->data[usbint] |= 1;
}

void EmulatedBoard::write_eeprom(std::uint16_t address, const std::vector<std::uint8_t>& bytes) {
    std::vector<std::uint8_t> copy = bytes;
    avr_eeprom_desc_t content{copy.data(), address, static_cast<std::uint32_t>(copy.size())};
    avr_ioctl(chip_->avr, AVR_IOCTL_EEPROM_SET, &content);
}

std::vector<std::uint8_t> EmulatedBoard::read_eeprom(std::uint16_t address, std::uint16_t size) const {
    std::vector<std::uint8_t> bytes(size);
    avr_eeprom_desc_t content{bytes.data(), address, size};
    avr_ioctl(chip_->avr, AVR_IOCTL_EEPROM_GET, &content);
    return bytes;
}

unsigned EmulatedBoard::stack_room() const { return chip_->avr->ramend - chip_->first_free + 1; }

unsigned EmulatedBoard::untouched_stack() const {
    unsigned untouched = 0;
    while (untouched < stack_room() && chip_->avr->data[chip_->first_free + untouched] == paint) ++untouched;
    return untouched;
}

EmulatedBoard::Handshake EmulatedBoard::setup(std::array<std::uint8_t, 8> bytes) {
    std::uint32_t size = bytes.size();
    return chip_->transfer(AVR_IOCTL_USB_SETUP, 0, bytes.data(), size);
}

EmulatedBoard::Handshake EmulatedBoard::out(std::uint8_t endpoint, const std::uint8_t* bytes, std::uint32_t size) {
    std::array<std::uint8_t, 64> packet{};
    std::copy_n(bytes, std::min<std::uint32_t>(size, 64), packet.begin());
    return chip_->transfer(AVR_IOCTL_USB_WRITE, endpoint, packet.data(), size);
}

EmulatedBoard::Handshake EmulatedBoard::in(std::uint8_t endpoint, std::vector<std::uint8_t>& bytes) {
    std::uint32_t size = 64;
    bytes.resize(size);
    const Handshake result = chip_->transfer(AVR_IOCTL_USB_READ, endpoint, bytes.data(), size);
    bytes.resize(result == Handshake::ack ? size : 0);
    return result;
}

bool EmulatedBoard::setup_waits() const { return (chip_->endpoint_flags(0) & 1 << 3) != 0; }

void EmulatedBoard::bus_reset() { avr_ioctl(chip_->avr, AVR_IOCTL_USB_RESET, nullptr); }

}  // namespace darkbox::test
