#include "rig/lamps/usb_bus.h"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <span>

#include "acquisition/device/device_error.h"
#include "firmware/protocol/lamp_protocol.h"
#include "rig/lamps/usb_errors.h"

namespace darkbox {
namespace {

constexpr int interface = 0;
constexpr timeval longest_wait{0, 100'000};

std::string place_of(libusb_device* device) {
    std::array<std::uint8_t, 8> ports{};
    const int count = libusb_get_port_numbers(device, ports.data(), ports.size());
    std::string path;
    for (int i = 0; i < count; ++i)
        path += fmt::format("{}{}", i == 0 ? "" : ".", static_cast<int>(ports.at(static_cast<std::size_t>(i))));
    return fmt::format("bus {}, port {}", libusb_get_bus_number(device), path.empty() ? "?" : path);
}

std::string serial_of(libusb_device_handle* handle, std::uint8_t index) {
    std::array<unsigned char, 64> text{};
    const int size = libusb_get_string_descriptor_ascii(handle, index, text.data(), text.size());
    if (size < 0) throw_usb("reading the serial number", size);
    return std::string(reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(size));
}

}  // namespace

struct UsbBus::Found {
    UsbBoardInfo info;
    Handle handle;
};

void UsbBus::CloseHandle::operator()(libusb_device_handle* handle) const { libusb_close(handle); }

UsbBus::UsbBus() {
    if (const int error = libusb_init(&context_); error != 0) throw_usb("libusb_init", error);
    const auto arrived = [](libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
        auto& bus = *static_cast<UsbBus*>(self);
        const std::lock_guard lock(bus.arrivals_mutex_);
        ++bus.arrivals_;
        bus.arrived_.notify_all();
        return 0;
    };
    libusb_hotplug_register_callback(context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED, LIBUSB_HOTPLUG_NO_FLAGS,
                                     lamp_protocol::vendor_id, lamp_protocol::product_id, LIBUSB_HOTPLUG_MATCH_ANY,
                                     arrived, this, &hotplug_);
    server_ = std::thread([this] { serve(); });
}

UsbBus::~UsbBus() {
    ends_ = true;
    libusb_hotplug_deregister_callback(context_, hotplug_);
    libusb_interrupt_event_handler(context_);
    server_.join();
    libusb_exit(context_);
}

void UsbBus::serve() {
    while (!ends_) {
        timeval wait = longest_wait;
        libusb_handle_events_timeout_completed(context_, &wait, nullptr);
    }
}

std::vector<UsbBus::Found> UsbBus::find() const {
    libusb_device** list = nullptr;
    const auto count = libusb_get_device_list(context_, &list);
    if (count < 0) throw_usb("listing USB devices", static_cast<int>(count));
    const std::unique_ptr<libusb_device*, void (*)(libusb_device**)> owner(
        list, [](libusb_device** l) { libusb_free_device_list(l, 1); });
    std::vector<Found> found;
    for (libusb_device* device : std::span(list, static_cast<std::size_t>(count))) {
        libusb_device_descriptor descriptor{};
        if (libusb_get_device_descriptor(device, &descriptor) != 0) continue;
        if (descriptor.idVendor != lamp_protocol::vendor_id || descriptor.idProduct != lamp_protocol::product_id)
            continue;
        Found board{{"", place_of(device), ""}, nullptr};
        libusb_device_handle* handle = nullptr;
        try {
            if (const int error = libusb_open(device, &handle); error != 0) throw_usb("opening it", error);
            board.handle.reset(handle);
            board.info.serial = serial_of(handle, descriptor.iSerialNumber);
        } catch (const DeviceError& error) {
            board.info.problem = fmt::format("{} ({})", error.what(), error.hint());
            board.handle.reset();
        }
        found.push_back(std::move(board));
    }
    return found;
}

std::vector<UsbBoardInfo> UsbBus::boards() const {
    std::vector<UsbBoardInfo> infos;
    for (const Found& board : find()) infos.push_back(board.info);
    return infos;
}

UsbBus::Handle UsbBus::open(const std::string& serial) const {
    std::vector<Found> all = find();
    const auto wanted = [&](const Found& board) {
        return board.handle && (serial.empty() || board.info.serial == serial);
    };
    const auto matches = std::count_if(all.begin(), all.end(), wanted);
    if (matches > 1)
        throw DeviceError(fmt::format("{} lamp controllers are plugged in", matches),
                          serial.empty()
                              ? "name one by serial under [lamps.usb]; darkbox lamps list --boards lists them"
                              : "two boards have one serial: flash another into one of them");
    if (matches == 0) {
        std::string others;
        for (const Found& board : all)
            others += fmt::format("; there is {} at {}",
                                  board.info.problem.empty() ? "'" + board.info.serial + "'" : board.info.problem,
                                  board.info.place);
        throw DeviceError(
            fmt::format("no lamp controller{} is plugged in{}", serial.empty() ? "" : " '" + serial + "'", others),
            "plug it in, and check its supply");
    }
    Handle handle = std::move(std::find_if(all.begin(), all.end(), wanted)->handle);
    if (const int error = libusb_claim_interface(handle.get(), interface); error != 0)
        throw_usb("claiming the lamp controller", error);
    return handle;
}

UsbBus::Handle UsbBus::open_within(const std::string& serial, Nanoseconds patience) {
    const auto end = std::chrono::steady_clock::now() + patience;
    for (;;) {
        std::unique_lock lock(arrivals_mutex_);
        const unsigned before = arrivals_;
        lock.unlock();
        try {
            return open(serial);
        } catch (const DeviceError&) {
            if (std::chrono::steady_clock::now() >= end) throw;
        }
        // Where no hot-plug events come (no udev), looking again now and then finds it as well.
        lock.lock();
        arrived_.wait_until(lock, std::min(end, std::chrono::steady_clock::now() + std::chrono::milliseconds(200)),
                            [&] { return arrivals_ != before; });
    }
}

}  // namespace darkbox
