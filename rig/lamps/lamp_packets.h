#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {

/// Packets for the lamp controller, and what comes back from it read with distrust: a packet of another size, or with
/// values that the protocol does not have, is none. Free functions on bytes; docs/lamp-protocol.md tells the layout.
using LampBytes = std::vector<std::uint8_t>;

LampBytes lamp_packet(lamp_protocol::Command command, std::uint8_t sequence, std::span<const std::uint8_t> payload);
template <typename Payload>
LampBytes lamp_payload(const Payload& payload) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&payload);
    return {bytes, bytes + sizeof payload};
}

std::optional<lamp_protocol::Info> parse_lamp_info(std::span<const std::uint8_t> bytes);
std::optional<lamp_protocol::Status> parse_lamp_status(std::span<const std::uint8_t> bytes);
std::optional<lamp_protocol::Event> parse_lamp_event(std::span<const std::uint8_t> bytes);
/// Only one whose CRC holds.
std::optional<lamp_protocol::Identity> parse_lamp_identity(std::span<const std::uint8_t> bytes);

/// Text of a fixed field; up to its first zero, other than printable characters as '?'.
std::string field_text(std::span<const char> field);

/// Sentences for people, one for each fault that stands.
std::vector<std::string> faults_in_words(unsigned faults);
std::string outcome_in_words(const lamp_protocol::Event& reply);

/// Whether this host and that board understand each other; otherwise why not.
std::optional<std::string> version_refusal(const lamp_protocol::Info& info);

}  // namespace darkbox
