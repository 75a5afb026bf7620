#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox::test {

/// What the lamps do: bit n is lamp n.
struct LampsSeen {
    std::uint64_t lit = 0;
    unsigned level = 0;  ///< 1 to 255 while something is lit

    bool operator==(const LampsSeen&) const = default;
};

/// The image that is flashed, on an emulated ATmega32U4 with the board's parts around it: the chain of 74HC595, the
/// drivers' output enable with its pull-up, the supply with its pull-down, thermistor, strobe, trigger. Time is the
/// chip's. Thread-hostile.
///
/// simavr 1.6 does not tell everything: it has no start of frame, suspend or VBUS (tests set the flags that the silicon
/// would set), models neither data toggles nor the bus's CRC, and takes 100 us for every byte on SPI (replaced here).
class EmulatedBoard {
public:
    static constexpr std::uint64_t cycles_per_us = 16;

    /// `identity` as EEPROM holds it; none: erased.
    EmulatedBoard(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity);
    EmulatedBoard(const EmulatedBoard&) = delete;
    EmulatedBoard& operator=(const EmulatedBoard&) = delete;
    ~EmulatedBoard();

    std::uint64_t cycle() const;
    double now_us() const { return static_cast<double>(cycle()) / cycles_per_us; }
    void run_us(double microseconds);
    void run_ms(double milliseconds) { run_us(milliseconds * 1000); }
    /// Runs until it holds, at most so long; whether it does.
    bool run_until(const std::function<bool()>& holds, double most_ms);

    LampsSeen lamps() const { return seen_; }
    bool supply_on() const;
    bool attached() const;
    /// Resets seen since the start: watchdog, brown-out.
    unsigned resets() const { return resets_; }
    bool in_bootloader() const;

    void set_thermistor(std::uint16_t reading);
    void set_strobe(bool active);
    /// The program counter stays where it is, with or without interrupts served: firmware that hangs.
    enum class Interrupts { served, off };
    void hang(Interrupts interrupts);
    /// The supply sags and the chip resets.
    void brown_out();
    /// The flags that the silicon sets when the bus is silent for 3 ms, and when VBUS falls.
    void signal_suspend();
    void signal_unplug();
    void write_eeprom(std::uint16_t address, const std::vector<std::uint8_t>& bytes);
    std::vector<std::uint8_t> read_eeprom(std::uint16_t address, std::uint16_t size) const;

    /// Bytes of RAM behind the variables that were never written since the start.
    unsigned untouched_stack() const;
    unsigned stack_room() const;

    /// One packet on the bus.
    enum class Handshake { ack, nak, stall, error };
    Handshake setup(std::array<std::uint8_t, 8> bytes);
    Handshake out(std::uint8_t endpoint, const std::uint8_t* bytes, std::uint32_t size);
    Handshake in(std::uint8_t endpoint, std::vector<std::uint8_t>& bytes);
    /// Whether the firmware has not read a SETUP yet.
    bool setup_waits() const;
    void bus_reset();

    std::function<void(const LampsSeen&)> on_lamps;
    std::function<void(bool)> on_trigger;

private:
    struct Simulator;
    void step();
    void look();

    std::unique_ptr<Simulator> chip_;
    LampsSeen seen_;
    bool trigger_ = false;
    unsigned resets_ = 0;
};

}  // namespace darkbox::test
