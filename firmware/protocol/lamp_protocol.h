#pragma once

// What the lamp controller and its host say to each other, in C++14 for both. docs/lamp-protocol.md describes it byte
// by byte. Numbers are little-endian; nothing here needs padding, and every size is asserted.
#include <stddef.h>
#include <stdint.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the structures below are copied as they lie in memory");

namespace darkbox {
namespace lamp_protocol {

/// A host and a board talk only when the major versions are equal and the board's minor is not below the host's.
constexpr uint8_t version_major = 1;
constexpr uint8_t version_minor = 0;

/// pid.codes' pair for private tests; who sells boards registers one of their own.
constexpr uint16_t vendor_id = 0x1209;
constexpr uint16_t product_id = 0x0001;
constexpr uint8_t command_endpoint = 0x01;  ///< bulk OUT
constexpr uint8_t event_endpoint = 0x82;    ///< interrupt IN

constexpr uint8_t largest_packet = 64;  ///< bytes; one packet is one command
constexpr uint8_t most_lamps = 64;
constexpr uint8_t most_steps = 66;  ///< a dark one, one lamp twice, and the other lamps

constexpr uint16_t shortest_heartbeat_ms = 50;
constexpr uint16_t longest_heartbeat_ms = 1000;
constexpr uint16_t longest_on_ms = 60000;
constexpr uint32_t longest_time_us = 0xFFFFFF;  ///< of a step's lead, and of its exposure
constexpr uint32_t shortest_exposure_us = 50;

/// Requests to endpoint 0: vendor, to the device.
enum class Request : uint8_t {
    info = 0x01,          ///< IN, Info
    status = 0x02,        ///< IN, Status
    identity = 0x03,      ///< IN, Identity as stored, be it valid or not
    dark = 0x10,          ///< OUT, no data: as Command::dark, and it works while commands are stuck
    set_identity = 0x11,  ///< OUT, Identity; wValue is identity_key
    bootloader = 0x12,    ///< OUT, no data; wValue is bootloader_key. Dark, supply off, then detached
};
constexpr uint16_t identity_key = 0x1DE7;
constexpr uint16_t bootloader_key = 0xB007;

constexpr uint32_t info_magic = 0x4C584244;  ///< "DBXL"

enum ResetCause : uint8_t { reset_power = 1, reset_pin = 2, reset_brown_out = 4, reset_watchdog = 8, reset_jtag = 16 };

struct Info {
    uint32_t magic;
    uint8_t protocol_major;
    uint8_t protocol_minor;
    uint8_t firmware_major;
    uint8_t firmware_minor;
    uint8_t lamps;        ///< outputs that exist; 0 without a valid identity
    uint8_t most_lit;     ///< at once, whatever the host asks for
    uint8_t steps;        ///< room in a program
    uint8_t reset_cause;  ///< ResetCause bits of the last start
    uint16_t most_on_ms;  ///< of any lamp, whatever the host asks for
    uint16_t reserved;
};
static_assert(sizeof(Info) == 16, "");

/// Latched until cleared; while one stands, nothing lights.
enum Fault : uint8_t {
    fault_host_lost = 0x01,    ///< silence, bus reset, suspend or unplugging while lit
    fault_on_too_long = 0x02,  ///< a lamp used up its budget while lit
    fault_too_hot = 0x04,
    fault_sensor = 0x08,    ///< the thermistor is missing
    fault_identity = 0x10,  ///< the stored identity is not valid; cleared by storing one
    fault_strobe = 0x20,    ///< the camera's strobe did not come
};

enum class Activity : uint8_t { dark = 0, lit = 1, program = 2 };

struct Status {
    uint8_t faults;
    Activity activity;
    uint8_t level;
    uint8_t step;  ///< of the program that runs
    uint32_t time_us;
    uint8_t lit[8];        ///< lamp n is bit n % 8 of byte n / 8
    uint16_t temperature;  ///< the converter's reading, 0 to 1023; lower is hotter
    uint16_t heartbeat_ms;
    uint16_t events_lost;
    uint8_t most_lit;
    uint8_t reserved;
};
static_assert(sizeof(Status) == 24, "");

/// Kept in EEPROM. A board without a valid one lights nothing.
struct Identity {
    uint8_t layout;       ///< 1
    uint8_t lamps;        ///< 1 to 64 outputs that exist
    uint8_t most_lit;     ///< 1 to 8
    uint8_t reserved;     ///< 0
    uint16_t most_on_ms;  ///< 1 to longest_on_ms
    uint16_t hot;         ///< readings below mean too hot; 1 to 900
    char serial[12];      ///< letters, digits, '-'; filled up with zeros
    char label[24];       ///< of the rig; printable ASCII, filled up with zeros
    uint16_t reserved_2;  ///< 0
    uint16_t crc;         ///< crc16 of what stands before
};
static_assert(sizeof(Identity) == 48 && offsetof(Identity, crc) == 46, "");
constexpr uint8_t identity_layout = 1;
constexpr uint8_t most_lit_of_any_board = 8;
constexpr uint16_t coolest_hot = 900;

enum class Command : uint8_t {
    heartbeat = 0x01,     ///< no payload
    dark = 0x02,          ///< no payload; ends a program, too
    light = 0x03,         ///< LightCommand
    configure = 0x04,     ///< ConfigureCommand
    limit = 0x05,         ///< LimitCommand
    clear_faults = 0x06,  ///< ClearCommand
    write_steps = 0x10,   ///< WriteStepsCommand
    run_program = 0x11,   ///< RunProgramCommand
};

/// Before every payload. The length is the packet's.
struct CommandHeader {
    Command command;
    uint8_t sequence;  ///< the reply repeats it
    uint16_t crc;      ///< crc16 of command, sequence and payload
};
static_assert(sizeof(CommandHeader) == 4, "");

/// These lamps, and no others.
struct LightCommand {
    uint8_t lamps[8];  ///< as Status::lit; at least one
    uint8_t level;     ///< 1 to 255, 255 is full
    uint8_t reserved[3];
};
static_assert(sizeof(LightCommand) == 12, "");

struct ConfigureCommand {
    uint16_t heartbeat_ms;  ///< shortest_heartbeat_ms to longest_heartbeat_ms
    uint8_t most_lit;       ///< 1 to Info::most_lit
    uint8_t reserved;
};
static_assert(sizeof(ConfigureCommand) == 4, "");

/// A lamp's budget is max_on_ms. Each millisecond of light takes one from it, each flash at least one; 64 ms of
/// darkness give `cooling` back. So it is never lit longer than max_on_ms at a stretch, nor more than the share
/// cooling / (64 + cooling) of a long time.
struct LimitCommand {
    uint8_t first;
    uint8_t count;
    uint16_t max_on_ms;  ///< 1 to Info::most_on_ms
    uint8_t cooling;     ///< 1 to 255
    uint8_t reserved[3];
};
static_assert(sizeof(LimitCommand) == 8, "");

struct ClearCommand {
    uint8_t faults;  ///< Fault bits
    uint8_t reserved[3];
};
static_assert(sizeof(ClearCommand) == 4, "");

/// One step of a program: its lamp alone is lit; `lead` later its exposure begins, at once or with the camera's strobe;
/// `exposure` later the next step follows without a gap.
struct Step {
    uint8_t lamp_and_mode;   ///< bits 0 to 5 the lamp, then step_trigger and step_wait_strobe
    uint8_t lead_us[3];      ///< 24 bits
    uint8_t level;           ///< 0: no lamp, a dark frame
    uint8_t exposure_us[3];  ///< 24 bits, from shortest_exposure_us
};
static_assert(sizeof(Step) == 8, "");
constexpr uint8_t step_lamp = 0x3F;
constexpr uint8_t step_trigger = 0x40;      ///< the trigger output is active during the exposure
constexpr uint8_t step_wait_strobe = 0x80;  ///< the exposure begins with the next rising edge of the strobe

constexpr uint8_t steps_per_packet = 7;
struct WriteStepsCommand {
    uint8_t first;
    uint8_t count;  ///< 1 to steps_per_packet; the packet ends with the last
    uint8_t reserved[2];
    Step steps[steps_per_packet];
};
static_assert(sizeof(WriteStepsCommand) == 60, "");
static_assert(sizeof(CommandHeader) + sizeof(WriteStepsCommand) == largest_packet, "");

/// Dark at once; the first step begins this much later, so that its time does not depend on how long the checks took.
constexpr uint32_t program_starts_after_us = 5000;
struct RunProgramCommand {
    uint8_t count;  ///< steps, from the first
    uint8_t reserved;
    uint16_t rounds;  ///< 1 or more
    uint16_t crc;     ///< crc16 of these steps: half a program never runs
    uint16_t reserved_2;
};
static_assert(sizeof(RunProgramCommand) == 8, "");

enum class Outcome : uint8_t {
    done = 0,
    bad_length = 1,
    bad_crc = 2,
    unknown_command = 3,
    no_such_lamp = 4,
    too_many_lit = 5,
    out_of_range = 6,    ///< a field; `detail` is its offset in the payload
    fault_stands = 7,    ///< `detail` holds the Fault bits
    program_runs = 8,    ///< only heartbeat and dark are taken while one does
    lamp_rests = 9,      ///< its budget is used up; `value` is the milliseconds until it has any
    other_program = 10,  ///< the steps stored have another CRC
    step_too_long = 11,  ///< `detail` is the step: longer than its lamp's max_on_ms
};

enum class EventKind : uint8_t {
    reply = 1,         ///< to a command: its sequence in `sequence`, an Outcome in `code`
    step = 2,          ///< a step is over: its place in `detail`, its lamp in `lamp`, `time_us` its exposure's begin
                       ///< and `value` its microseconds
    program_done = 3,  ///< after the last step
    fault = 4,         ///< `code` the Fault bit that came, `lamp` the lamp at fault or no_lamp
};
constexpr uint8_t no_lamp = 0xFF;

struct Event {
    EventKind kind;
    uint8_t number;  ///< counts all events, so that a lost one is noticed
    uint8_t sequence;
    uint8_t code;
    uint32_t time_us;  ///< the board's clock; wraps after 71.6 minutes
    uint32_t value;
    uint8_t detail;
    uint8_t lamp;
    uint16_t round;  ///< of a program, from 0
};
static_assert(sizeof(Event) == 16, "");

/// In flash, so that an image tells what it is before it is flashed.
struct ImageMark {
    char magic[16];  ///< image_magic
    uint8_t protocol_major;
    uint8_t protocol_minor;
    uint8_t firmware_major;
    uint8_t firmware_minor;
};
static_assert(sizeof(ImageMark) == 20, "");
#define DARKBOX_LAMP_IMAGE_MAGIC "darkbox-lampctl"  // 15 characters and a zero

/// CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF, nothing reflected. Of "123456789" it is 0x29B1.
constexpr uint16_t crc16_start = 0xFFFF;
inline uint16_t crc16_add(uint16_t crc, uint8_t byte) {
    uint8_t x = static_cast<uint8_t>((crc >> 8) ^ byte);
    x = static_cast<uint8_t>(x ^ (x >> 4));
    return static_cast<uint16_t>((crc << 8) ^ (static_cast<uint16_t>(x) << 12) ^ (static_cast<uint16_t>(x) << 5) ^ x);
}
inline uint16_t crc16(const void* data, size_t size, uint16_t crc = crc16_start) {
    const uint8_t* bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < size; ++i) crc = crc16_add(crc, bytes[i]);
    return crc;
}

/// The CRC that belongs into a packet's header.
inline uint16_t packet_crc(const uint8_t* packet, size_t size) {
    uint16_t crc = crc16(packet, offsetof(CommandHeader, crc));
    return crc16(packet + sizeof(CommandHeader), size - sizeof(CommandHeader), crc);
}

inline uint32_t read_24(const uint8_t (&bytes)[3]) {
    return static_cast<uint32_t>(bytes[0]) | static_cast<uint32_t>(bytes[1]) << 8 |
           static_cast<uint32_t>(bytes[2]) << 16;
}
inline void write_24(uint8_t (&bytes)[3], uint32_t value) {
    bytes[0] = static_cast<uint8_t>(value);
    bytes[1] = static_cast<uint8_t>(value >> 8);
    bytes[2] = static_cast<uint8_t>(value >> 16);
}

}  // namespace lamp_protocol
}  // namespace darkbox
