#pragma once

#include <filesystem>

namespace darkbox::sim {

/// A wire between two processes: one drives it, the other looks. A byte of a file that both have mapped, '1' while it
/// is up. Thread-safe.
class SharedLine {
public:
    /// Makes the file, with the line down, unless it is there. Throws DeviceError.
    explicit SharedLine(const std::filesystem::path& file);
    SharedLine(const SharedLine&) = delete;
    SharedLine& operator=(const SharedLine&) = delete;
    ~SharedLine();

    void drive(bool up);
    bool is_up() const;

private:
    char* level_;
};

}  // namespace darkbox::sim
