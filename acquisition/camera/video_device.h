#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "acquisition/device/unique_fd.h"
#include "acquisition/frame/units.h"

namespace darkbox {

/// The system calls that drive one video node, and nothing else: what the driver's code above asks of the kernel, so
/// that tests can answer in its place. Calls return 0, or the errno that they failed with. Thread-compatible.
class VideoDevice {
public:
    enum class Readiness {
        ready,      ///< a buffer is finished
        timed_out,  ///< or a signal came
        failed,     ///< poll() reports an error or a hang-up; the next call tells which
    };
    struct Mapping {
        int error = 0;
        std::span<std::byte> bytes;
    };

    virtual ~VideoDevice() = default;
    virtual int open(const std::string& path) = 0;
    /// Safe in any state.
    virtual void close() = 0;
    virtual int ioctl(unsigned long request, void* argument) = 0;
    virtual Mapping map(std::size_t length, std::int64_t offset) = 0;
    virtual void unmap(std::span<std::byte> bytes) = 0;
    virtual Readiness poll(Nanoseconds patience) = 0;
};

/// The kernel's.
class KernelVideoDevice final : public VideoDevice {
public:
    int open(const std::string& path) override;
    void close() override { fd_.reset(); }
    int ioctl(unsigned long request, void* argument) override;
    Mapping map(std::size_t length, std::int64_t offset) override;
    void unmap(std::span<std::byte> bytes) override;
    Readiness poll(Nanoseconds patience) override;

private:
    UniqueFd fd_;
};

}  // namespace darkbox
