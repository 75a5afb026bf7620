#pragma once

#include <stdint.h>

#include "firmware/protocol/lamp_protocol.h"

namespace darkbox {
namespace lampctl {

/// Events that wait for the host to fetch them. A full queue loses the new one; its number is missing then.
class EventQueue {
public:
    static constexpr uint8_t room = 8;

    void push(lamp_protocol::Event event) {
        event.number = next_number_++;
        if (size_ == room) {
            ++lost_;
            return;
        }
        events_[(first_ + size_) % room] = event;
        ++size_;
    }
    bool empty() const { return size_ == 0; }
    const lamp_protocol::Event& front() const { return events_[first_]; }
    void pop() {
        first_ = static_cast<uint8_t>((first_ + 1) % room);
        --size_;
    }
    void clear() { size_ = 0; }
    uint16_t lost() const { return lost_; }

private:
    lamp_protocol::Event events_[room] = {};
    uint8_t first_ = 0;
    uint8_t size_ = 0;
    uint8_t next_number_ = 0;
    uint16_t lost_ = 0;
};

}  // namespace lampctl
}  // namespace darkbox
