#pragma once

#include <avr/io.h>

// What hangs on which pin; docs/lamp-controller.md draws it.
//
//   PB0 SS     latch (RCLK) of the 74HC595 chain
//   PB1 SCLK   their shift clock
//   PB2 MOSI   their serial input
//   PB4        lamp supply enable, active high; pulled down, so off in reset and in the bootloader
//   PC6 OC3A   output enable of the drivers, active low; pulled up, so dark in reset and in the bootloader
//   PC7        trigger output to the camera, active high
//   PD0 INT0   strobe input from the camera, rising edge begins its exposure
//   PF4 ADC4   thermistor to ground, its fixed resistor to AVCC

namespace darkbox {
namespace board {

constexpr uint8_t latch_pin = _BV(PB0);
constexpr uint8_t spi_clock_pin = _BV(PB1);
constexpr uint8_t spi_data_pin = _BV(PB2);
constexpr uint8_t supply_pin = _BV(PB4);
constexpr uint8_t blank_pin = _BV(PC6);
constexpr uint8_t trigger_pin = _BV(PC7);
constexpr uint8_t strobe_pin = _BV(PD0);
constexpr uint8_t thermistor_channel = 4;

}  // namespace board
}  // namespace darkbox
