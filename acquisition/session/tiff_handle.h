#pragma once

#include <tiffio.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace darkbox {

/// What libtiff said about one file: its first error, empty when there was none.
struct TiffMessages {
    std::string first_error;
};

struct TiffCloser {
    void operator()(TIFF* tiff) const noexcept { ::TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, TiffCloser>;

/// A growing file in memory.
struct MemoryFile {
    std::vector<std::byte> bytes;
    std::size_t position = 0;
};

/// Both give an empty handle on failure. Errors go to `messages` and warnings nowhere: libtiff prints nothing. What is
/// passed must outlive the handle.
TiffHandle open_tiff(const std::filesystem::path& file, TiffMessages& messages);
TiffHandle open_tiff_for_writing(MemoryFile& memory, TiffMessages& messages);

}  // namespace darkbox
