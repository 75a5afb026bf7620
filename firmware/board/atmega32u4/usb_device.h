#pragma once

#include <stdint.h>

namespace darkbox {
namespace board {

/// A request to endpoint 0 as it lies on the bus.
struct SetupPacket {
    uint8_t type;
    uint8_t request;
    uint16_t value;
    uint16_t index;
    uint16_t length;
};
static_assert(sizeof(SetupPacket) == 8, "");

/// The chip's USB device, of one configuration with a bulk OUT and an interrupt IN endpoint. Nothing here waits: poll()
/// is called from the main loop, and all that it leaves open goes on at the next call. An answer is one packet of at
/// most 63 bytes.
class UsbDevice {
public:
    static constexpr uint8_t largest_answer = 63;

    /// What the device is for; the firmware's main part.
    class Client {
    public:
        /// A vendor request to read: writes the answer and returns its size, or `refused`.
        virtual uint8_t read(const SetupPacket& setup, uint8_t* answer) = 0;
        /// A vendor request that wants `setup.length` bytes, all of them here; false refuses it.
        virtual bool write(const SetupPacket& setup, const uint8_t* data) = 0;
        /// A packet from the bulk endpoint.
        virtual void packet(const uint8_t* bytes, uint8_t size) = 0;
        /// The next packet for the interrupt endpoint, 16 bytes; false if there is none.
        virtual bool next_event(uint8_t* bytes) = 0;
        /// The bus was reset, suspended or unplugged, or the configuration taken back.
        virtual void host_gone() = 0;
        /// The serial number's characters; zero-terminated, or `room` long.
        virtual const char* serial(uint8_t& room) = 0;

    protected:
        ~Client() = default;
    };
    static constexpr uint8_t refused = 0xFF;

    explicit UsbDevice(Client& client) : client_(client) {}

    void attach();
    void detach();
    void poll();
    /// Whether poll() has something to do; interrupts off. Otherwise asks for an interrupt when it does.
    bool idle();

private:
    enum class Stage : uint8_t { none, answering, receiving, confirming };

    void poll_bus();
    void poll_control();
    void poll_commands();
    void poll_events();
    void setup();
    void receive();
    bool standard_out(const SetupPacket& setup);
    uint8_t standard_in(const SetupPacket& setup);
    uint8_t descriptor(const SetupPacket& setup);
    uint8_t string(uint8_t index);
    bool configure(uint8_t configuration);
    bool halt(uint8_t endpoint, bool on);
    void answer(uint8_t size);
    void confirm();
    void stall();

    Client& client_;
    SetupPacket setup_ = {};
    uint8_t buffer_[64] = {};
    uint8_t answer_size_ = 0;
    Stage stage_ = Stage::none;
    uint8_t configuration_ = 0;
    uint8_t halted_ = 0;  ///< bit n: endpoint n
};

}  // namespace board
}  // namespace darkbox
