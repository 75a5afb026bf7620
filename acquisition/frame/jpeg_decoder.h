#pragma once

#include <csetjmp>
#include <cstdio>

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace darkbox {

/// libjpeg's decompressor, whose errors become words. libjpeg leaves its functions by longjmp: whoever calls them says
/// `if (setjmp(decoder.way_out) != 0) return false;` first, and holds nothing there that needs a destructor.
struct JpegDecoder {
    using Watch = void (*)(j_common_ptr common, int level);

    /// `watch` hears what libjpeg warns of (level < 0), and leaves where that is an error.
    explicit JpegDecoder(Watch watch) {
        decompress.err = ::jpeg_std_error(&errors);
        decompress.client_data = this;
        errors.error_exit = leave;
        errors.emit_message = watch;
        errors.output_message = [](j_common_ptr) {};
    }
    JpegDecoder(const JpegDecoder&) = delete;
    JpegDecoder& operator=(const JpegDecoder&) = delete;
    ~JpegDecoder() { ::jpeg_destroy_decompress(&decompress); }

    [[noreturn]] static void leave(j_common_ptr common) {
        auto& self = *static_cast<JpegDecoder*>(common->client_data);
        common->err->format_message(common, self.error);
        std::longjmp(self.way_out, 1);
    }

    bool start() {
        if (setjmp(way_out) != 0) return false;
        return ::jpeg_start_decompress(&decompress) == TRUE;
    }
    bool read_row(JSAMPROW row) {
        if (setjmp(way_out) != 0) return false;
        return ::jpeg_read_scanlines(&decompress, &row, 1) == 1;
    }

    jpeg_decompress_struct decompress{};
    jpeg_error_mgr errors{};
    std::jmp_buf way_out{};
    char error[JMSG_LENGTH_MAX] = "";
};

}  // namespace darkbox
