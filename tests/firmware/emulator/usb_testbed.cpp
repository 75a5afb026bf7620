#include "tests/firmware/emulator/usb_testbed.h"

#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <umockdev.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace darkbox::test {
namespace {

/// As the kernel's: how long a reader of finished transfers waits here before it is told that there is none.
constexpr auto reap_patience = std::chrono::microseconds(1500);

struct Unref {
    void operator()(gpointer object) const { g_object_unref(object); }
};
using DataPtr = std::unique_ptr<UMockdevIoctlData, Unref>;

/// Null when the client is gone, or gave a null pointer.
DataPtr resolve(UMockdevIoctlData* data, std::size_t offset, std::size_t size) {
    GError* error = nullptr;
    DataPtr resolved(umockdev_ioctl_data_resolve(data, offset, size, &error));
    g_clear_error(&error);
    return resolved;
}

void update(UMockdevIoctlData* data, std::size_t offset, const void* bytes, std::size_t size) {
    umockdev_ioctl_data_update(data, offset, const_cast<guint8*>(static_cast<const guint8*>(bytes)),
                               static_cast<gint>(size));
}

}  // namespace

struct UsbTestbed::Bed {
    UMockdevTestbed* testbed = umockdev_testbed_new();
    int next_address = 2;
    std::mutex mutex;
    ~Bed() { g_object_unref(testbed); }
};

/// One board, and the URBs that its clients gave.
struct UsbTestbed::Device {
    /// One plugging in, as umockdev's thread has it: its socket stays until the bed ends, for umockdev aborts a client
    /// that opened the node and finds no socket. Whoever comes after the cable was pulled, or after the device has
    /// ended, is told ENODEV.
    struct Link {
        explicit Link(Device* d) : device(d) {}
        std::mutex mutex;
        Device* device;  ///< guarded by mutex
        std::atomic<bool> here{true};
    };
    struct Urb {
        std::unique_ptr<UMockdevIoctlClient, Unref> client;  ///< kept, so that no later client has its address
        PacedBoard::RequestPtr request;
        DataPtr urb;
        DataPtr buffer;
        bool is_control = false;
    };

    Device(Bed& b, int n, const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity)
        : bed(b), number(n), board(elf, identity) {
        board.on_presence = [this](bool present) { present ? appear() : vanish(); };
        appear();
    }
    ~Device() {
        vanish();
        for (const std::shared_ptr<Link>& link : links) {
            const std::lock_guard lock(link->mutex);
            link->device = nullptr;
        }
    }

    void appear();
    void vanish();
    static gboolean handle(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer link);
    void answer(UMockdevIoctlClient* client, bool here);
    void submit(UMockdevIoctlClient* client, UMockdevIoctlData* urb_data);
    void reap(UMockdevIoctlClient* client, UMockdevIoctlData* pointer, bool here);
    void discard(UMockdevIoctlClient* client);
    void drop_the_departed();

    Bed& bed;
    int number;
    std::vector<std::shared_ptr<Link>> links;  ///< the last one is of the present node
    std::string syspath;
    std::list<Urb> urbs;  ///< on the handler's thread alone
    PacedBoard board;     ///< the first to end: its thread uses the others
};

void UsbTestbed::Device::appear() {
    const std::lock_guard lock(bed.mutex);
    const int address = bed.next_address++;
    const std::string node = fmt::format("/dev/bus/usb/001/{:03}", address);
    const auto& d = board.device_descriptor;
    const std::string path = fmt::format("/devices/pci0000:00/0000:00:14.0/usb1/1-{}", number + 1);
    syspath = "/sys" + path;
    std::string hex;
    for (const std::uint8_t byte : d) hex += fmt::format("{:02X}", byte);
    for (const std::uint8_t byte : board.configuration_descriptor) hex += fmt::format("{:02X}", byte);
    const std::string device = fmt::format(
        "P: {}\nN: bus/usb/001/{:03}\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME={}\nE: BUSNUM=001\n"
        "E: DEVNUM={:03}\nE: MAJOR=189\nE: MINOR={}\nA: busnum=1\\n\nA: devnum={}\\n\nA: idVendor={:02x}{:02x}\\n\n"
        "A: idProduct={:02x}{:02x}\\n\nA: bConfigurationValue=1\\n\nA: bNumConfigurations=1\\n\nA: speed=12\\n\n"
        "A: devpath={}\\n\nH: descriptors={}\n",
        path, address, node, address, address - 1, address, d[9], d[8], d[11], d[10], number + 1, hex);
    links.push_back(std::make_shared<Link>(this));
    UMockdevIoctlBase* handler = umockdev_ioctl_base_new();
    g_signal_connect_data(
        handler, "handle-ioctl", G_CALLBACK(&Device::handle), new std::shared_ptr<Link>(links.back()),
        [](gpointer held, GClosure*) { delete static_cast<std::shared_ptr<Link>*>(held); }, GConnectFlags{});
    umockdev_testbed_attach_ioctl(bed.testbed, node.c_str(), handler, nullptr);  // before anybody can open the node
    g_object_unref(handler);
    GError* error = nullptr;
    if (umockdev_testbed_add_from_string(bed.testbed, device.c_str(), &error) == 0)
        throw std::runtime_error(fmt::format("umockdev: {}", error->message));
    umockdev_testbed_uevent(bed.testbed, syspath.c_str(), "add");
}

void UsbTestbed::Device::vanish() {
    const std::lock_guard lock(bed.mutex);
    if (links.empty() || !links.back()->here.exchange(false)) return;
    umockdev_testbed_uevent(bed.testbed, syspath.c_str(), "remove");
    umockdev_testbed_remove_device(bed.testbed, syspath.c_str());
}

gboolean UsbTestbed::Device::handle(UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer link) {
    Link& held = **static_cast<std::shared_ptr<Link>*>(link);
    const std::lock_guard lock(held.mutex);
    if (held.device != nullptr)
        held.device->answer(client, held.here);
    else
        umockdev_ioctl_client_complete(client, -1, ENODEV);
    return TRUE;
}

/// As the kernel does when a file is closed: the transfers of a process that was killed end with it.
void UsbTestbed::Device::drop_the_departed() {
    urbs.remove_if([&](const Urb& urb) {
        const bool departed = umockdev_ioctl_client_get_connected(urb.client.get()) == FALSE;
        if (departed) board.drop(urb.request);
        return departed;
    });
}

void UsbTestbed::Device::answer(UMockdevIoctlClient* client, bool here) {
    const unsigned long request = umockdev_ioctl_client_get_request(client);
    UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
    const auto complete = [&](long result, int error) { umockdev_ioctl_client_complete(client, result, error); };
    drop_the_departed();
    if (request == USBDEVFS_REAPURBNDELAY) {
        const DataPtr pointer = resolve(arg, 0, sizeof(void*));
        if (!pointer) return complete(-1, EFAULT);
        reap(client, pointer.get(), here);
    } else if (request == USBDEVFS_DISCARDURB) {
        discard(client);
    } else if (!here) {
        complete(-1, ENODEV);
    } else if (request == USBDEVFS_SUBMITURB) {
        submit(client, resolve(arg, 0, sizeof(usbdevfs_urb)).release());
    } else if (request == USBDEVFS_CLAIMINTERFACE || request == USBDEVFS_RELEASEINTERFACE ||
               request == USBDEVFS_SETCONFIGURATION) {
        complete(0, 0);
    } else if (request == USBDEVFS_CLEAR_HALT) {
        const DataPtr value = resolve(arg, 0, sizeof(unsigned));
        if (!value) return complete(-1, EFAULT);
        const auto endpoint = static_cast<std::uint16_t>(*reinterpret_cast<const unsigned*>(value->data));
        board.with_board([&](EmulatedBoard&, EmulatedHost& host) { host.control({0x02, 1, 0, endpoint, 0}); });
        complete(0, 0);
    } else if (request == USBDEVFS_RESET) {
        board.with_board([&](EmulatedBoard&, EmulatedHost& host) { host.enumerate(); });
        complete(0, 0);
    } else if (request == USBDEVFS_GETDRIVER) {
        complete(-1, ENODATA);
    } else {
        complete(-1, ENOTTY);
    }
}

void UsbTestbed::Device::submit(UMockdevIoctlClient* client, UMockdevIoctlData* urb_data) {
    const auto refuse = [&](int error) { umockdev_ioctl_client_complete(client, -1, error); };
    Urb urb;
    urb.client.reset(static_cast<UMockdevIoctlClient*>(g_object_ref(client)));
    urb.urb.reset(urb_data);
    if (!urb.urb) return refuse(EFAULT);
    usbdevfs_urb raw;
    std::memcpy(&raw, urb_data->data, sizeof raw);
    const auto length = static_cast<std::size_t>(raw.buffer_length);
    urb.buffer = resolve(urb_data, offsetof(usbdevfs_urb, buffer), length);
    if (!urb.buffer && length > 0) return refuse(EFAULT);
    const std::uint8_t* bytes = urb.buffer ? urb.buffer->data : nullptr;
    auto request = std::make_shared<UsbRequest>();
    request->endpoint = raw.endpoint;
    urb.is_control = raw.type == USBDEVFS_URB_TYPE_CONTROL;
    if (urb.is_control && length < 8) return refuse(EINVAL);
    if (urb.is_control) {
        const auto word = [&](int at) { return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8); };
        request->endpoint = 0;
        request->control = {bytes[0], bytes[1], word(2), word(4), word(6)};
        if ((bytes[0] & 0x80) == 0) request->data.assign(bytes + 8, bytes + length);
    } else if ((raw.endpoint & 0x80) == 0) {
        request->data.assign(bytes, bytes + length);
    }
    request->wanted = length;
    request->owner = client;
    urb.request = request;
    urbs.push_back(std::move(urb));
    board.submit(request);
    umockdev_ioctl_client_complete(client, 0, 0);
}

void UsbTestbed::Device::reap(UMockdevIoctlClient* client, UMockdevIoctlData* pointer, bool here) {
    const auto request = board.take_ended(client, reap_patience);
    const auto found =
        std::find_if(urbs.begin(), urbs.end(), [&](const Urb& urb) { return request && urb.request == request; });
    if (found == urbs.end()) {
        umockdev_ioctl_client_complete(client, -1, here || !urbs.empty() ? EAGAIN : ENODEV);
        return;
    }
    const bool in = ((found->is_control ? request->control.type : request->endpoint) & 0x80) != 0;
    const std::size_t offset = found->is_control ? 8 : 0;
    const std::size_t room = request->wanted - std::min(request->wanted, offset);
    const auto actual = static_cast<int>(request->error != 0 ? 0 : std::min(room, request->data.size()));
    if (in && actual > 0) update(found->buffer.get(), offset, request->data.data(), static_cast<std::size_t>(actual));
    update(found->urb.get(), offsetof(usbdevfs_urb, status), &request->error, sizeof request->error);
    update(found->urb.get(), offsetof(usbdevfs_urb, actual_length), &actual, sizeof actual);
    umockdev_ioctl_data_set_ptr(pointer, 0, found->urb.get());
    umockdev_ioctl_client_complete(client, 0, 0);
    urbs.erase(found);
}

void UsbTestbed::Device::discard(UMockdevIoctlClient* client) {
    UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
    gulong address = 0;
    std::memcpy(&address, arg->data, sizeof address);
    const auto found = std::find_if(urbs.begin(), urbs.end(), [&](const Urb& urb) {
        return urb.request->owner == client && urb.urb->client_addr == address;
    });
    const bool discarded = found != urbs.end() && board.discard(found->request);
    umockdev_ioctl_client_complete(client, discarded ? 0 : -1, discarded ? 0 : EINVAL);
}

UsbTestbed::UsbTestbed() : bed_(std::make_unique<Bed>()) {}
UsbTestbed::~UsbTestbed() { devices_.clear(); }

bool UsbTestbed::available() {
    const char* preloaded = std::getenv("LD_PRELOAD");
    return preloaded != nullptr && std::strstr(preloaded, "umockdev") != nullptr;
}

int UsbTestbed::plug_in(const std::filesystem::path& elf, const std::optional<lamp_protocol::Identity>& identity) {
    const auto number = static_cast<int>(devices_.size());
    devices_[number] = std::make_unique<Device>(*bed_, number, elf, identity);
    return number;
}

PacedBoard& UsbTestbed::board(int number) { return devices_.at(number)->board; }

void UsbTestbed::pull_cable(int number) {
    devices_.at(number)->vanish();
    board(number).set_plugged(false);
}

void UsbTestbed::plug_cable(int number) {
    board(number).set_plugged(true);
    devices_.at(number)->appear();
}

}  // namespace darkbox::test
