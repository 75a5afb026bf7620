#include "rig/lamps/lamp_packets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace darkbox {

using namespace lamp_protocol;

namespace {

template <typename T>
std::optional<T> as(std::span<const std::uint8_t> bytes) {
    if (bytes.size() != sizeof(T)) return std::nullopt;
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
}

}  // namespace

LampBytes lamp_packet(Command command, std::uint8_t sequence, std::span<const std::uint8_t> payload) {
    LampBytes packet(sizeof(CommandHeader) + payload.size());
    packet[0] = static_cast<std::uint8_t>(command);
    packet[1] = sequence;
    std::copy(payload.begin(), payload.end(), packet.begin() + sizeof(CommandHeader));
    const std::uint16_t crc = packet_crc(packet.data(), packet.size());
    std::memcpy(packet.data() + offsetof(CommandHeader, crc), &crc, sizeof crc);
    return packet;
}

std::optional<Info> parse_lamp_info(std::span<const std::uint8_t> bytes) {
    const auto info = as<Info>(bytes);
    return info && info->magic == info_magic && info->lamps <= most_lamps ? info : std::nullopt;
}

std::optional<Status> parse_lamp_status(std::span<const std::uint8_t> bytes) {
    const auto status = as<Status>(bytes);
    return status && status->activity <= Activity::program ? status : std::nullopt;
}

std::optional<Event> parse_lamp_event(std::span<const std::uint8_t> bytes) {
    const auto event = as<Event>(bytes);
    if (!event || event->kind < EventKind::reply || event->kind > EventKind::fault) return std::nullopt;
    if (event->lamp != no_lamp && event->lamp >= most_lamps) return std::nullopt;
    if (event->kind == EventKind::step && event->detail >= most_steps) return std::nullopt;
    if (event->kind == EventKind::reply && event->code > static_cast<std::uint8_t>(Outcome::step_too_long))
        return std::nullopt;
    return event;
}

std::optional<Identity> parse_lamp_identity(std::span<const std::uint8_t> bytes) {
    const auto identity = as<Identity>(bytes);
    if (!identity || crc16(&*identity, offsetof(Identity, crc)) != identity->crc) return std::nullopt;
    return identity->layout == identity_layout && identity->lamps >= 1 && identity->lamps <= most_lamps ? identity
                                                                                                        : std::nullopt;
}

std::string field_text(std::span<const char> field) {
    std::string text(field.begin(), std::find(field.begin(), field.end(), '\0'));
    std::replace_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

std::vector<std::string> faults_in_words(unsigned faults) {
    struct Known {
        Fault fault;
        const char* words;
    };
    static constexpr Known known[] = {
        {fault_host_lost, "the lamp controller heard nothing of its host while lit, and went dark"},
        {fault_on_too_long, "a lamp was lit until its max_on_s or max_duty was used up"},
        {fault_too_hot, "the lamp controller is too hot"},
        {fault_sensor, "the lamp controller's thermistor is missing"},
        {fault_identity, "the lamp controller has no valid identity (darkbox lamps flash --serial stores one)"},
        {fault_strobe, "the camera's strobe did not come"},
    };
    std::vector<std::string> sentences;
    for (const Known& k : known)
        if ((faults & k.fault) != 0) sentences.emplace_back(k.words);
    return sentences;
}

std::string outcome_in_words(const Event& reply) {
    switch (static_cast<Outcome>(reply.code)) {
        case Outcome::done:
            return "done";
        case Outcome::bad_length:
            return "a packet of wrong length";
        case Outcome::bad_crc:
            return "a packet damaged on its way";
        case Outcome::unknown_command:
            return "a command that it does not know";
        case Outcome::no_such_lamp:
            return "a lamp that it does not have";
        case Outcome::too_many_lit:
            return fmt::format("more lamps at once than {}", reply.detail);
        case Outcome::out_of_range:
            return fmt::format("a value out of range, in byte {}", reply.detail);
        case Outcome::fault_stands:
            if (faults_in_words(reply.detail).empty()) return "a fault stands that this darkbox does not know";
            return fmt::format("{}", fmt::join(faults_in_words(reply.detail), "; "));
        case Outcome::program_runs:
            return fmt::format("a program runs, at step {}", reply.detail);
        case Outcome::lamp_rests:
            return fmt::format("its budget is used up; it may shine in {} ms", reply.value);
        case Outcome::other_program:
            return "the program did not arrive whole";
        case Outcome::step_too_long:
            return fmt::format("step {} lights a lamp beyond its max_on_s", reply.detail);
    }
    return "an answer that this darkbox does not know";
}

std::optional<std::string> version_refusal(const Info& info) {
    if (info.protocol_major == version_major && info.protocol_minor >= version_minor) return std::nullopt;
    return fmt::format("the lamp controller speaks version {}.{} of the lamp protocol, this darkbox version {}.{}",
                       info.protocol_major, info.protocol_minor, version_major, version_minor);
}

}  // namespace darkbox
