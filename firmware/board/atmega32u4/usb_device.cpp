#include "firmware/board/atmega32u4/usb_device.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <string.h>

#include "firmware/board/atmega32u4/usb_descriptors.h"

namespace darkbox {
namespace board {
namespace {

constexpr uint8_t control = 0, commands = 1, events = 2;

enum : uint8_t { to_host = 0x80, kind_mask = 0x60, kind_standard = 0x00, kind_vendor = 0x40, recipient_mask = 0x1F };
enum : uint8_t { recipient_device = 0, recipient_interface = 1, recipient_endpoint = 2 };
enum : uint8_t {
    get_status = 0,
    clear_feature = 1,
    set_feature = 3,
    set_address = 5,
    get_descriptor = 6,
    get_configuration = 8,
    set_configuration = 9,
    get_interface = 10,
    set_interface = 11
};

/// A flag is acknowledged by writing a zero to it and ones to the others.
uint8_t acknowledge(uint8_t flags) { return static_cast<uint8_t>(~flags); }

void open_endpoint(uint8_t number, uint8_t type, uint8_t size) {
    UENUM = number;
    UECONX = _BV(EPEN);
    UECFG0X = type;
    UECFG1X = size;
}

void open_control_endpoint() { open_endpoint(control, 0, _BV(EPSIZE1) | _BV(EPSIZE0) | _BV(ALLOC)); }

uint8_t copy_from_flash(uint8_t* to, const uint8_t* from, uint8_t size) {
    memcpy_P(to, from, size);
    return size;
}

}  // namespace

void UsbDevice::attach() {
    UHWCON = _BV(UVREGE);
    USBCON = _BV(USBE) | _BV(FRZCLK);
    PLLCSR = _BV(PINDIV) | _BV(PLLE);
    while ((PLLCSR & _BV(PLOCK)) == 0) {
    }
    USBCON = _BV(USBE) | _BV(OTGPADE);
    UDINT = 0;
    USBINT = 0;
    UDCON = 0;  // full speed, attached
}

void UsbDevice::detach() { UDCON = _BV(DETACH); }

bool UsbDevice::idle() {
    UENUM = control;
    const bool control_waits = (UEINTX & (_BV(RXSTPI) | _BV(RXOUTI))) != 0 || stage_ == Stage::answering;
    UEIENX = _BV(RXSTPE) | _BV(RXOUTE);
    if (configuration_ == 0) return !control_waits;
    UENUM = commands;
    const bool command_waits = (UEINTX & _BV(RXOUTI)) != 0;
    UEIENX = _BV(RXOUTE);
    UENUM = control;
    return !control_waits && !command_waits;
}

void UsbDevice::poll() {
    poll_bus();
    poll_control();
    if (configuration_ == 0) return;
    poll_commands();
    poll_events();
}

void UsbDevice::poll_bus() {
    const uint8_t happened = UDINT;
    if ((happened & (_BV(EORSTI) | _BV(SUSPI))) != 0) {
        UDINT = acknowledge(_BV(EORSTI) | _BV(SUSPI));
        client_.host_gone();
    }
    if ((happened & _BV(EORSTI)) != 0) {
        open_control_endpoint();
        configuration_ = 0;
        stage_ = Stage::none;
        halted_ = 0;
    }
    if ((USBINT & _BV(VBUSTI)) != 0) {
        USBINT = acknowledge(_BV(VBUSTI));
        if ((USBSTA & _BV(VBUS)) == 0) client_.host_gone();
    }
}

void UsbDevice::poll_control() {
    UENUM = control;
    const uint8_t flags = UEINTX;
    if ((flags & _BV(RXSTPI)) != 0)
        setup();
    else if ((flags & _BV(RXOUTI)) != 0)
        receive();
    UENUM = control;
    if (stage_ == Stage::answering && (UEINTX & _BV(TXINI)) != 0) {
        for (uint8_t i = 0; i < answer_size_; ++i) UEDATX = buffer_[i];
        UEINTX = acknowledge(_BV(TXINI));
        stage_ = Stage::none;
    }
    if (stage_ == Stage::confirming && (UEINTX & _BV(TXINI)) != 0) {
        UDADDR |= _BV(ADDEN);  // only after the old address has confirmed
        stage_ = Stage::none;
    }
}

void UsbDevice::setup() {
    uint8_t* bytes = reinterpret_cast<uint8_t*>(&setup_);
    for (uint8_t i = 0; i < sizeof setup_; ++i) bytes[i] = UEDATX;
    UEINTX = acknowledge(_BV(RXSTPI));
    stage_ = Stage::none;
    const uint8_t kind = setup_.type & kind_mask;
    if ((setup_.type & to_host) != 0) {
        const uint8_t size = kind == kind_standard ? standard_in(setup_)
                             : kind == kind_vendor ? client_.read(setup_, buffer_)
                                                   : refused;
        answer(size);
    } else if (kind == kind_vendor && setup_.length > 0 && setup_.length <= largest_answer) {
        stage_ = Stage::receiving;
    } else if (setup_.length == 0 && kind == kind_vendor && client_.write(setup_, buffer_)) {
        confirm();
    } else if (setup_.length == 0 && kind == kind_standard && standard_out(setup_)) {
        confirm();
    } else {
        stall();
    }
}

/// The data of a request to us, or the host's confirmation of an answer.
void UsbDevice::receive() {
    const uint8_t size = UEBCLX;
    if (stage_ == Stage::receiving)
        for (uint8_t i = 0; i < size && i < sizeof buffer_; ++i) buffer_[i] = UEDATX;
    UEINTX = acknowledge(_BV(RXOUTI));
    if (stage_ != Stage::receiving) return;
    stage_ = Stage::none;
    if (size == setup_.length && client_.write(setup_, buffer_))
        confirm();
    else
        stall();
}

void UsbDevice::answer(uint8_t size) {
    if (size == refused) {
        stall();
        return;
    }
    answer_size_ = setup_.length < size ? static_cast<uint8_t>(setup_.length) : size;
    stage_ = Stage::answering;
}

void UsbDevice::confirm() {
    UENUM = control;
    UEINTX = acknowledge(_BV(TXINI));
}

void UsbDevice::stall() {
    UENUM = control;
    UECONX = _BV(STALLRQ) | _BV(EPEN);
}

uint8_t UsbDevice::standard_in(const SetupPacket& setup) {
    const uint8_t recipient = setup.type & recipient_mask;
    if (setup.request == get_descriptor && recipient == recipient_device) return descriptor(setup);
    if (setup.request == get_configuration && recipient == recipient_device) {
        buffer_[0] = configuration_;
        return 1;
    }
    if (setup.request == get_interface && recipient == recipient_interface && configuration_ != 0 && setup.index == 0) {
        buffer_[0] = 0;
        return 1;
    }
    if (setup.request != get_status) return refused;
    buffer_[0] = buffer_[1] = 0;
    if (recipient == recipient_device) {
        buffer_[0] = 1;  // self-powered
    } else if (recipient == recipient_endpoint) {
        const uint8_t endpoint = setup.index & 0x0F;
        if (endpoint > events) return refused;
        buffer_[0] = (halted_ >> endpoint) & 1;
    } else if (recipient != recipient_interface) {
        return refused;
    }
    return 2;
}

uint8_t UsbDevice::descriptor(const SetupPacket& setup) {
    switch (setup.value >> 8) {
        case 1:
            return copy_from_flash(buffer_, descriptors::device, sizeof descriptors::device);
        case 2:
            if ((setup.value & 0xFF) != 0) return refused;
            return copy_from_flash(buffer_, descriptors::configuration, sizeof descriptors::configuration);
        case 3:
            return string(static_cast<uint8_t>(setup.value));
        default:
            return refused;
    }
}

uint8_t UsbDevice::string(uint8_t index) {
    if (index == 0) return copy_from_flash(buffer_, descriptors::languages, sizeof descriptors::languages);
    if (index > 3) return refused;
    uint8_t room = 30;
    const char* stored = index == 3 ? client_.serial(room) : nullptr;
    const char* in_flash = index == 1 ? descriptors::manufacturer : descriptors::product;
    uint8_t size = 2;
    for (uint8_t i = 0; i < room; ++i) {
        const char c = stored != nullptr ? stored[i] : static_cast<char>(pgm_read_byte(in_flash + i));
        if (c == 0) break;
        buffer_[size++] = static_cast<uint8_t>(c);
        buffer_[size++] = 0;
    }
    buffer_[0] = size;
    buffer_[1] = 3;
    return size;
}

bool UsbDevice::standard_out(const SetupPacket& setup) {
    const uint8_t recipient = setup.type & recipient_mask;
    switch (setup.request) {
        case set_address:
            if (recipient != recipient_device || setup.value > 0x7F) return false;
            UDADDR = static_cast<uint8_t>(setup.value);
            stage_ = Stage::confirming;
            return true;
        case set_configuration:
            return recipient == recipient_device && configure(static_cast<uint8_t>(setup.value));
        case set_interface:
            return recipient == recipient_interface && configuration_ != 0 && setup.value == 0 && setup.index == 0;
        case set_feature:
        case clear_feature:
            return recipient == recipient_endpoint && setup.value == 0 &&
                   halt(static_cast<uint8_t>(setup.index), setup.request == set_feature);
        default:
            return false;
    }
}

bool UsbDevice::configure(uint8_t configuration) {
    if (configuration > 1) return false;
    client_.host_gone();  // whoever spoke before does not now
    configuration_ = configuration;
    halted_ = 0;
    if (configuration == 0) return true;
    open_endpoint(commands, _BV(EPTYPE1), _BV(EPSIZE1) | _BV(EPSIZE0) | _BV(EPBK0) | _BV(ALLOC));
    open_endpoint(events, _BV(EPTYPE1) | _BV(EPTYPE0) | _BV(EPDIR), _BV(EPSIZE0) | _BV(ALLOC));
    UERST = _BV(commands) | _BV(events);
    UERST = 0;
    return true;
}

bool UsbDevice::halt(uint8_t endpoint, bool on) {
    const uint8_t number = endpoint & 0x0F;
    const bool ours = endpoint == (0x00 | commands) || endpoint == (to_host | events);
    if (configuration_ == 0 || !ours) return false;
    UENUM = number;
    if (on) {
        UECONX = _BV(STALLRQ) | _BV(EPEN);
        halted_ |= static_cast<uint8_t>(_BV(number));
    } else {
        UECONX = _BV(STALLRQC) | _BV(RSTDT) | _BV(EPEN);
        UERST = static_cast<uint8_t>(_BV(number));
        UERST = 0;
        halted_ &= static_cast<uint8_t>(~_BV(number));
    }
    return true;
}

void UsbDevice::poll_commands() {
    UENUM = commands;
    if ((UEINTX & _BV(RXOUTI)) == 0) return;
    const uint8_t size = UEBCLX;
    for (uint8_t i = 0; i < size; ++i) {
        const uint8_t byte = UEDATX;
        if (i < sizeof buffer_) buffer_[i] = byte;
    }
    UEINTX = acknowledge(_BV(RXOUTI));
    UEINTX = acknowledge(_BV(FIFOCON));
    client_.packet(buffer_, size);
}

void UsbDevice::poll_events() {
    UENUM = events;
    if ((UEINTX & _BV(TXINI)) == 0 || (halted_ & _BV(events)) != 0) return;
    uint8_t bytes[descriptors::event_size];
    if (!client_.next_event(bytes)) return;
    UENUM = events;
    UEINTX = acknowledge(_BV(TXINI));
    for (uint8_t i = 0; i < sizeof bytes; ++i) UEDATX = bytes[i];
    UEINTX = acknowledge(_BV(FIFOCON));
}

}  // namespace board
}  // namespace darkbox

/// Only wakes the main loop, which looks at the flags itself and asks again before it sleeps.
ISR(USB_COM_vect) {
    const uint8_t endpoint = UENUM;
    for (uint8_t i = darkbox::board::control; i <= darkbox::board::commands; ++i) {
        UENUM = i;
        UEIENX = 0;
    }
    UENUM = endpoint;
}
