#include "sim/bridge/shared_line.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>

#include "acquisition/device/device_error.h"
#include "acquisition/device/unique_fd.h"

namespace darkbox::sim {

SharedLine::SharedLine(const std::filesystem::path& file) {
    const UniqueFd fd(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    if (!fd || ::ftruncate(fd.get(), 1) != 0) throw_errno("open", file.string(), errno);
    void* mapped = ::mmap(nullptr, 1, PROT_READ | PROT_WRITE, MAP_SHARED, fd.get(), 0);
    if (mapped == MAP_FAILED) throw_errno("mmap", file.string(), errno);
    level_ = static_cast<char*>(mapped);
}

SharedLine::~SharedLine() { ::munmap(level_, 1); }

void SharedLine::drive(bool up) { std::atomic_ref(*level_).store(up ? '1' : '0'); }
bool SharedLine::is_up() const { return std::atomic_ref(*level_).load() == '1'; }

}  // namespace darkbox::sim
