#include "rig/lamps/usb_link.h"

#include <libusb.h>

#include <array>
#include <condition_variable>
#include <mutex>

#include "acquisition/device/device_error.h"
#include "rig/lamps/usb_errors.h"

namespace darkbox {
namespace {

using namespace lamp_protocol;

struct FreeTransfer {
    void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};
using TransferPtr = std::unique_ptr<libusb_transfer, FreeTransfer>;

int as_error(libusb_transfer_status status) {
    switch (status) {
        case LIBUSB_TRANSFER_COMPLETED:
            return 0;
        case LIBUSB_TRANSFER_STALL:
            return LIBUSB_ERROR_PIPE;
        case LIBUSB_TRANSFER_NO_DEVICE:
            return LIBUSB_ERROR_NO_DEVICE;
        case LIBUSB_TRANSFER_OVERFLOW:
            return LIBUSB_ERROR_OVERFLOW;
        case LIBUSB_TRANSFER_TIMED_OUT:
        case LIBUSB_TRANSFER_CANCELLED:
            return LIBUSB_ERROR_TIMEOUT;
        default:
            return LIBUSB_ERROR_IO;
    }
}

/// One transfer, from submission to its end.
class OneTransfer {
public:
    OneTransfer() : transfer_(libusb_alloc_transfer(0)) {
        if (!transfer_) throw_usb("libusb_alloc_transfer", LIBUSB_ERROR_NO_MEM);
    }
    libusb_transfer* get() const { return transfer_.get(); }
    static void ended(libusb_transfer* transfer) {
        auto& self = *static_cast<OneTransfer*>(transfer->user_data);
        const std::lock_guard lock(self.mutex_);
        self.ended_ = true;
        self.end_.notify_all();
    }

    /// Bytes transferred. At the deadline it is cancelled: nothing is left under way when this returns or throws.
    int run(const char* what, Nanoseconds patience) {
        if (const int error = libusb_submit_transfer(transfer_.get()); error != 0) throw_usb(what, error);
        std::unique_lock lock(mutex_);
        if (!end_.wait_for(lock, patience, [this] { return ended_; })) {
            lock.unlock();
            libusb_cancel_transfer(transfer_.get());
            lock.lock();
            end_.wait(lock, [this] { return ended_; });
        }
        if (const int error = as_error(transfer_->status); error != 0) throw_usb(what, error);
        return transfer_->actual_length;
    }

private:
    TransferPtr transfer_;
    std::mutex mutex_;
    std::condition_variable end_;
    bool ended_ = false;  ///< guarded by mutex_
};

// To the device.
constexpr std::uint8_t vendor_out = LIBUSB_REQUEST_TYPE_VENDOR;
constexpr std::uint8_t vendor_in = vendor_out | std::uint8_t{LIBUSB_ENDPOINT_IN};

}  // namespace

/// Keeps transfers waiting on the event endpoint; two, so that none is missed while one is read.
struct UsbLink::Listener {
    static constexpr std::size_t transfers = 2;

    explicit Listener(UsbLink& l) : link(l) {
        for (std::size_t i = 0; i < transfers; ++i) {
            waiting.at(i).reset(libusb_alloc_transfer(0));
            libusb_fill_interrupt_transfer(waiting.at(i).get(), link.handle_.get(), event_endpoint,
                                           buffers.at(i).data(), static_cast<int>(buffers.at(i).size()), came, this, 0);
        }
    }
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;
    ~Listener() {
        std::unique_lock lock(mutex);
        ends = true;
        for (const TransferPtr& transfer : waiting) libusb_cancel_transfer(transfer.get());
        ended.wait(lock, [this] { return under_way == 0; });
    }

    void listen() {
        const std::lock_guard lock(mutex);
        if (under_way != 0) return;
        for (const TransferPtr& transfer : waiting) submit(transfer.get());
    }
    void submit(libusb_transfer* transfer) {
        if (libusb_submit_transfer(transfer) == 0)
            ++under_way;
        else
            link.gone_ = true;
    }
    static void came(libusb_transfer* transfer) {
        auto& self = *static_cast<Listener*>(transfer->user_data);
        const bool completed = transfer->status == LIBUSB_TRANSFER_COMPLETED;
        if (completed && transfer->actual_length > 0)
            self.link.on_packet_({transfer->buffer, static_cast<std::size_t>(transfer->actual_length)});
        const std::lock_guard lock(self.mutex);
        --self.under_way;
        if (completed && !self.ends)
            self.submit(transfer);
        else if (transfer->status == LIBUSB_TRANSFER_STALL)
            self.link.stalled_ = true;
        else if (transfer->status != LIBUSB_TRANSFER_CANCELLED)
            self.link.gone_ = true;
        self.ended.notify_all();
    }

    UsbLink& link;
    std::array<std::array<std::uint8_t, largest_packet>, transfers> buffers{};
    std::array<TransferPtr, transfers> waiting;
    std::mutex mutex;
    std::condition_variable ended;
    std::size_t under_way = 0;  ///< guarded by mutex
    bool ends = false;          ///< guarded by mutex
};

UsbLink::UsbLink(UsbBus::Handle handle, OnPacket on_packet)
    : handle_(std::move(handle)), on_packet_(std::move(on_packet)), listener_(std::make_unique<Listener>(*this)) {
    listener_->listen();
}

UsbLink::~UsbLink() = default;

std::vector<std::uint8_t> UsbLink::read(Request request, std::size_t size, Nanoseconds patience) {
    std::vector<std::uint8_t> buffer(LIBUSB_CONTROL_SETUP_SIZE + size);
    OneTransfer transfer;
    libusb_fill_control_setup(buffer.data(), vendor_in, static_cast<std::uint8_t>(request), 0, 0,
                              static_cast<std::uint16_t>(size));
    libusb_fill_control_transfer(transfer.get(), handle_.get(), buffer.data(), OneTransfer::ended, &transfer, 0);
    const int got = transfer.run("asking the lamp controller", patience);
    return {buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE, buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE + got};
}

void UsbLink::write(Request request, std::uint16_t value, std::span<const std::uint8_t> data, Nanoseconds patience) {
    std::vector<std::uint8_t> buffer(LIBUSB_CONTROL_SETUP_SIZE);
    buffer.insert(buffer.end(), data.begin(), data.end());
    OneTransfer transfer;
    libusb_fill_control_setup(buffer.data(), vendor_out, static_cast<std::uint8_t>(request), value, 0,
                              static_cast<std::uint16_t>(data.size()));
    libusb_fill_control_transfer(transfer.get(), handle_.get(), buffer.data(), OneTransfer::ended, &transfer, 0);
    transfer.run("telling the lamp controller", patience);
}

void UsbLink::send(std::span<const std::uint8_t> packet, Nanoseconds patience) {
    std::vector<std::uint8_t> bytes(packet.begin(), packet.end());
    OneTransfer transfer;
    libusb_fill_bulk_transfer(transfer.get(), handle_.get(), command_endpoint, bytes.data(),
                              static_cast<int>(bytes.size()), OneTransfer::ended, &transfer, 0);
    transfer.run("sending to the lamp controller", patience);
}

void UsbLink::clear_halts() {
    libusb_clear_halt(handle_.get(), command_endpoint);
    libusb_clear_halt(handle_.get(), event_endpoint);
    stalled_ = false;
    listener_->listen();
}

}  // namespace darkbox
