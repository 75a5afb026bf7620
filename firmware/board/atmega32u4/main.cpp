// The lamp controller on an ATmega32U4. The main loop serves USB and ticks; interrupts do what must happen at its
// microsecond. Everything that touches the core has interrupts off.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/power.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <string.h>
#include <util/atomic.h>
#include <util/delay.h>

#include "firmware/board/atmega32u4/clock.h"
#include "firmware/board/atmega32u4/identity_store.h"
#include "firmware/board/atmega32u4/lamp_chain.h"
#include "firmware/board/atmega32u4/pins.h"
#include "firmware/board/atmega32u4/reset.h"
#include "firmware/board/atmega32u4/usb_device.h"
#include "firmware/board/atmega32u4/version.h"
#include "firmware/lampctl/controller.h"
#include "firmware/lampctl/identity.h"

namespace darkbox {
namespace board {

using namespace lamp_protocol;
using lampctl::Controller;

/// Read by whoever flashes this image; the linker is told to keep what no code refers to.
extern "C" const ImageMark darkbox_image_mark;
const ImageMark darkbox_image_mark __attribute__((progmem, used)) = {DARKBOX_LAMP_IMAGE_MAGIC, version_major,
                                                                     version_minor, firmware_major, firmware_minor};

namespace {

LampChain chain;
Controller controller(chain);
Identity identity;

void follow_program() {
    if (controller.waits())
        set_alarm(controller.deadline_us());
    else
        clear_alarm();
}

void take_identity() {
    identity = load_identity();
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        controller.identify(identity);
        chain.supply(lampctl::valid(identity));
    }
}

class Service final : public UsbDevice::Client {
public:
    uint8_t read(const SetupPacket& setup, uint8_t* answer) override {
        switch (static_cast<Request>(setup.request)) {
            case Request::info: {
                Info info = controller.info();
                info.firmware_major = firmware_major;
                info.firmware_minor = firmware_minor;
                info.reset_cause = reset_cause();
                return put(answer, info);
            }
            case Request::status: {
                Status status;
                ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { status = controller.status(now_us()); }
                return put(answer, status);
            }
            case Request::identity:
                return put(answer, identity);
            default:
                return UsbDevice::refused;
        }
    }

    bool write(const SetupPacket& setup, const uint8_t* data) override {
        switch (static_cast<Request>(setup.request)) {
            case Request::dark:
                if (setup.length != 0) return false;
                darken();
                return true;
            case Request::set_identity:
                return setup.value == identity_key && set_identity(setup, data);
            case Request::bootloader:
                if (setup.length != 0 || setup.value != bootloader_key) return false;
                bootloader_wanted_ = true;
                return true;
            default:
                return false;
        }
    }

    void packet(const uint8_t* bytes, uint8_t size) override {
        const Outcome checked = Controller::check(bytes, size);
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            controller.execute(bytes, size, checked, now_us());
            follow_program();
        }
    }

    bool next_event(uint8_t* bytes) override {
        bool some = false;
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            some = !controller.events().empty();
            if (some) {
                memcpy(bytes, &controller.events().front(), sizeof(Event));
                controller.events().pop();
            }
        }
        return some;
    }

    void host_gone() override {
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            controller.host_gone(now_us());
            follow_program();
        }
    }

    const char* serial(uint8_t& room) override {
        if (!lampctl::valid(identity)) return "UNSET";
        room = sizeof identity.serial;
        return identity.serial;
    }

    bool bootloader_wanted() const { return bootloader_wanted_; }
    void darken() {
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            controller.dark();
            follow_program();
        }
    }

private:
    template <typename Answer>
    static uint8_t put(uint8_t* answer, const Answer& what) {
        static_assert(sizeof what <= UsbDevice::largest_answer, "");
        memcpy(answer, &what, sizeof what);
        return sizeof what;
    }

    static bool set_identity(const SetupPacket& setup, const uint8_t* data) {
        Identity wanted;
        if (setup.length != sizeof wanted || !controller.is_dark()) return false;
        memcpy(&wanted, data, sizeof wanted);
        if (!lampctl::valid(wanted)) return false;
        store_identity(wanted);
        take_identity();
        return true;
    }

    bool bootloader_wanted_ = false;
};

Service service;
UsbDevice usb(service);

/// Works with the fuses that the chip is sold with, too: those divide the clock by 8, and give the thermistor's pin to
/// JTAG.
void overrule_fuses() {
    clock_prescale_set(clock_div_1);
    MCUCR = _BV(JTD);
    MCUCR = _BV(JTD);  // takes effect when written twice within four cycles
}

void start_inputs() {
    PORTD &= static_cast<uint8_t>(~strobe_pin);
    EICRA = _BV(ISC01) | _BV(ISC00);  // rising edge
    EIMSK = _BV(INT0);
    DIDR0 = _BV(thermistor_channel);
    ADMUX = _BV(REFS0) | thermistor_channel;
    ADCSRA = _BV(ADEN) | _BV(ADSC) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0);
}

void read_thermistor() {
    if ((ADCSRA & _BV(ADSC)) != 0) return;
    const uint16_t reading = ADC;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { controller.temperature(reading, now_us()); }
    ADCSRA |= _BV(ADSC);
}

void tick() {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        controller.tick(now_us());
        follow_program();
    }
    read_thermistor();
}

/// A host notices a reset only if the device was gone for a while.
void stay_detached() { _delay_ms(20); }

[[noreturn]] void start_bootloader() {
    service.darken();
    chain.supply(false);
    _delay_ms(5);  // the request's confirmation goes out
    usb.detach();
    wdt_reset();
    stay_detached();
    reset_into_bootloader();
}

void sleep_until_something() {
    cli();
    if (!usb.idle()) {
        sei();
        return;
    }
    sleep_enable();
    sei();  // takes effect after the next instruction: an interrupt cannot come in between
    sleep_cpu();
    sleep_disable();
}

[[noreturn]] void run() {
    set_sleep_mode(SLEEP_MODE_IDLE);
    for (;;) {
        sleep_until_something();
        bool ticked = false;
        while (take_tick()) {
            tick();
            ticked = true;
        }
        if (ticked) wdt_reset();  // bites when this loop stands still, and when the ticks do
        usb.poll();
        if (service.bootloader_wanted()) start_bootloader();
    }
}

}  // namespace

void on_alarm() {
    controller.advance(now_us());
    follow_program();
}

}  // namespace board
}  // namespace darkbox

ISR(INT0_vect) {
    darkbox::board::controller.strobe(darkbox::board::now_us());
    darkbox::board::follow_program();
}

int main() {
    using namespace darkbox::board;
    chain.start();
    overrule_fuses();
    stay_detached();
    take_identity();
    start_clock();
    start_inputs();
    wdt_enable(WDTO_120MS);
    usb.attach();
    sei();
    run();
}
