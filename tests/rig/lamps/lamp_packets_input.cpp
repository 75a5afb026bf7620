#include "tests/rig/lamps/lamp_packets_input.h"

#include <algorithm>
#include <stdexcept>

#include "rig/lamps/device_clock.h"
#include "rig/lamps/lamp_packets.h"

namespace darkbox::test {
namespace {

using namespace lamp_protocol;

void require(bool holds, const char* what) {
    if (!holds) throw std::logic_error(what);
}

void require_printable(const std::string& text) {
    require(std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; }), "unprintable");
}

void read_event(const Event& event) {
    require(event.kind >= EventKind::reply && event.kind <= EventKind::fault, "a kind that there is not");
    require(event.lamp == no_lamp || event.lamp < most_lamps, "a lamp that there is not");
    require(event.kind != EventKind::step || event.detail < most_steps, "a step that there is not");
    if (event.kind == EventKind::reply) require(!outcome_in_words(event).empty(), "no words");
    for (const std::string& sentence : faults_in_words(event.code)) require_printable(sentence);
}

void read_identity(const Identity& identity) {
    require(identity.lamps >= 1 && identity.lamps <= most_lamps, "lamps that there cannot be");
    require_printable(field_text(identity.serial));
    require_printable(field_text(identity.label));
    require(field_text(identity.label).size() <= sizeof identity.label, "beyond the field");
}

}  // namespace

void play_to_lamp_packets(const std::uint8_t* bytes, std::size_t size) {
    DeviceClock clock;
    std::span<const std::uint8_t> left(bytes, size);
    TimePoint now{std::chrono::seconds(1000)};
    while (!left.empty()) {
        const std::size_t length = std::min<std::size_t>(left.front() & 0x3F, left.size() - 1);
        const bool mend = (left.front() & 0x80) != 0;  // with the CRC that it should have
        const auto packet = left.subspan(1, length);
        left = left.subspan(1 + length);
        now += std::chrono::milliseconds(length);
        if (const auto info = parse_lamp_info(packet)) {
            require(info->magic == info_magic && info->lamps <= most_lamps, "an info that is none");
            version_refusal(*info);
        }
        if (const auto status = parse_lamp_status(packet)) faults_in_words(status->faults);
        if (const auto event = parse_lamp_event(packet)) {
            read_event(*event);
            clock.exchange(now - std::chrono::milliseconds(1), now, event->time_us);
            const auto mapped = clock.map(event->value);
            require(mapped && mapped->uncertainty >= Nanoseconds(0), "a time without uncertainty");
        }
        LampBytes whole(packet.begin(), packet.end());
        if (mend && whole.size() == sizeof(Identity)) {
            const std::uint16_t crc = crc16(whole.data(), offsetof(Identity, crc));
            whole[offsetof(Identity, crc)] = static_cast<std::uint8_t>(crc);
            whole[offsetof(Identity, crc) + 1] = static_cast<std::uint8_t>(crc >> 8U);
        }
        if (const auto identity = parse_lamp_identity(whole)) read_identity(*identity);
    }
}

}  // namespace darkbox::test
