#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "acquisition/frame/units.h"

struct libusb_context;
struct libusb_device;
struct libusb_device_handle;

namespace darkbox {

/// A lamp controller that is plugged in. Without permission to open it, `problem` says so and the serial is empty.
struct UsbBoardInfo {
    std::string serial;
    std::string place;  ///< "bus 1, port 2.4"
    std::string problem;
};

/// libusb's context with the thread that serves it. Boards are found by the protocol's vendor and product numbers and
/// known by their serial; hot-plug tells when one comes. Thread-safe.
class UsbBus {
public:
    struct CloseHandle {
        void operator()(libusb_device_handle* handle) const;
    };
    using Handle = std::unique_ptr<libusb_device_handle, CloseHandle>;

    UsbBus();
    UsbBus(const UsbBus&) = delete;
    UsbBus& operator=(const UsbBus&) = delete;
    ~UsbBus();

    std::vector<UsbBoardInfo> boards() const;
    /// The board of that serial, or the only one when it is empty; its interface claimed. Throws DeviceError when it is
    /// not there, cannot be opened, or it is not clear which is meant.
    Handle open(const std::string& serial) const;
    /// open(), but waits so long for a board that is not there.
    Handle open_within(const std::string& serial, Nanoseconds patience);

private:
    struct Found;
    std::vector<Found> find() const;
    void serve();

    libusb_context* context_ = nullptr;
    int hotplug_ = 0;
    std::atomic<bool> ends_{false};
    std::mutex arrivals_mutex_;
    std::condition_variable arrived_;
    unsigned arrivals_ = 0;  ///< guarded by arrivals_mutex_
    std::thread server_;
};

}  // namespace darkbox
