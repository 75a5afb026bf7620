#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace darkbox {

/// Rows of bytes that are too many for memory, in a file without a name that vanishes with this object. Different rows
/// may be written and read by several threads at once.
class RowStore {
public:
    /// In `folder`, which is made where it is missing. Throws InputError when the disk has no room for all rows.
    RowStore(const std::filesystem::path& folder, std::size_t rows, std::size_t bytes_per_row);
    RowStore(const RowStore&) = delete;
    RowStore& operator=(const RowStore&) = delete;
    ~RowStore();

    std::size_t bytes_per_row() const { return bytes_per_row_; }
    /// `bytes` is one row's; throws InputError when it cannot be written or read.
    void write(std::size_t row, std::span<const std::byte> bytes);
    /// A row that was never written is all zeros.
    void read(std::size_t row, std::span<std::byte> bytes) const;

private:
    std::filesystem::path folder_;
    std::size_t bytes_per_row_;
    int fd_ = -1;
};

}  // namespace darkbox
