#include "acquisition/session/disk_fault.h"

#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

namespace darkbox {
namespace {

struct Installed {
    std::filesystem::path folder;
    DiskFault fault;
};

std::mutex installing;
std::optional<Installed> installed;  // guarded by installing

std::filesystem::path plain(const std::filesystem::path& path) {
    return std::filesystem::absolute(path).lexically_normal();
}

bool is_below(const std::filesystem::path& folder, const std::filesystem::path& file) {
    const std::filesystem::path way = plain(file).lexically_relative(folder);
    return !way.empty() && *way.begin() != "..";
}

}  // namespace

FailingDisk::FailingDisk(std::filesystem::path folder, DiskFault fault) {
    const std::scoped_lock lock(installing);
    if (installed) throw std::logic_error("a disk fails already");
    installed = {plain(folder), std::move(fault)};
}

FailingDisk::~FailingDisk() {
    const std::scoped_lock lock(installing);
    installed.reset();
}

int disk_fault_of(const std::filesystem::path& file) {
    const std::scoped_lock lock(installing);
    return installed && is_below(installed->folder, file) ? installed->fault() : 0;
}

}  // namespace darkbox
