#include "acquisition/camera/video_device.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>

namespace darkbox {

int KernelVideoDevice::open(const std::string& path) {
    fd_.reset(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    return fd_ ? 0 : errno;
}

int KernelVideoDevice::ioctl(unsigned long request, void* argument) {
    while (::ioctl(fd_.get(), request, argument) != 0)
        if (errno != EINTR) return errno;
    return 0;
}

VideoDevice::Mapping KernelVideoDevice::map(std::size_t length, std::int64_t offset) {
    void* address = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), offset);
    if (address == MAP_FAILED) return {errno, {}};
    return {0, {static_cast<std::byte*>(address), length}};
}

void KernelVideoDevice::unmap(std::span<std::byte> bytes) { ::munmap(bytes.data(), bytes.size()); }

VideoDevice::Readiness KernelVideoDevice::poll(Nanoseconds patience) {
    using std::chrono::milliseconds;
    constexpr milliseconds longest(60'000);
    const auto wait = std::clamp(std::chrono::ceil<milliseconds>(patience), milliseconds(0), longest);
    pollfd waiting{fd_.get(), POLLIN, 0};
    const int found = ::poll(&waiting, 1, static_cast<int>(wait.count()));
    if (found == 0 || (found < 0 && errno == EINTR)) return Readiness::timed_out;
    return found > 0 && waiting.revents == POLLIN ? Readiness::ready : Readiness::failed;
}

}  // namespace darkbox
