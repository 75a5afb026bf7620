#include "acquisition/session/tiff_handle.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace darkbox {
namespace {

constexpr int handled = 1;  // libtiff: do not call the global handlers, which print

int keep_first_error(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
    auto& messages = *static_cast<TiffMessages*>(user_data);
    if (messages.first_error.empty()) {
        std::array<char, 512> text{};
        std::vsnprintf(text.data(), text.size(), format, arguments);
        messages.first_error = text.data();
    }
    return handled;
}

int drop_warning(TIFF*, void*, const char*, const char*, va_list) { return handled; }

struct OptionsDeleter {
    void operator()(TIFFOpenOptions* options) const noexcept { ::TIFFOpenOptionsFree(options); }
};
using Options = std::unique_ptr<TIFFOpenOptions, OptionsDeleter>;

Options quiet_options(TiffMessages& messages) {
    Options options(::TIFFOpenOptionsAlloc());
    ::TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_first_error, &messages);
    ::TIFFOpenOptionsSetWarningHandlerExtR(options.get(), drop_warning, nullptr);
    return options;
}

MemoryFile& memory_of(thandle_t handle) { return *static_cast<MemoryFile*>(handle); }

tmsize_t read_memory(thandle_t handle, void* target, tmsize_t size) {
    MemoryFile& file = memory_of(handle);
    if (file.position >= file.bytes.size()) return 0;
    const std::size_t count = std::min(static_cast<std::size_t>(size), file.bytes.size() - file.position);
    std::memcpy(target, file.bytes.data() + file.position, count);
    file.position += count;
    return static_cast<tmsize_t>(count);
}

tmsize_t write_memory(thandle_t handle, void* source, tmsize_t size) {
    MemoryFile& file = memory_of(handle);
    const std::size_t end = file.position + static_cast<std::size_t>(size);
    if (end > file.bytes.size()) file.bytes.resize(end);
    std::memcpy(file.bytes.data() + file.position, source, static_cast<std::size_t>(size));
    file.position = end;
    return size;
}

toff_t seek_memory(thandle_t handle, toff_t offset, int whence) {
    MemoryFile& file = memory_of(handle);
    const toff_t start = whence == SEEK_CUR ? file.position : whence == SEEK_END ? file.bytes.size() : 0;
    file.position = start + offset;
    return file.position;
}

toff_t size_of_memory(thandle_t handle) { return memory_of(handle).bytes.size(); }
int close_memory(thandle_t) { return 0; }
int map_memory(thandle_t, void**, toff_t*) { return 0; }
void unmap_memory(thandle_t, void*, toff_t) {}

}  // namespace

TiffHandle open_tiff(const std::filesystem::path& file, TiffMessages& messages) {
    return TiffHandle(::TIFFOpenExt(file.c_str(), "r", quiet_options(messages).get()));
}

TiffHandle open_tiff_for_writing(MemoryFile& memory, TiffMessages& messages) {
    return TiffHandle(::TIFFClientOpenExt("frame", "wl", &memory, read_memory, write_memory, seek_memory, close_memory,
                                          size_of_memory, map_memory, unmap_memory, quiet_options(messages).get()));
}

}  // namespace darkbox
