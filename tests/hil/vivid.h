#pragma once

#include <cstdint>
#include <string>

namespace darkbox::test {

/// The kernel's test driver vivid: a webcam and a camera at an HDMI input, whose pictures and faults are set by
/// controls of its own. Loaded by the constructor, unloaded by the destructor.
class Vivid {
public:
    /// Ids of vivid's controls (drivers/media/test-drivers/vivid/vivid-ctrls.c of Linux 6.1).
    enum Control : std::uint32_t {
        test_pattern = 0x00f0f000,
        osd_text_mode = 0x00f0f001,
        show_square = 0x00f0f005,
        timestamp_source = 0x00f0f018,
        wrap_sequence_number = 0x00f0f026,
        percentage_of_dropped_buffers = 0x00f0f040,
        disconnect = 0x00f0f041,
        inject_buffer_error = 0x00f0f042,
        inject_reqbufs_error = 0x00f0f043,
        inject_qbuf_error = 0x00f0f044,
        inject_streamon_error = 0x00f0f045,
        inject_fatal_error = 0x00f0f046,
    };
    enum Pattern { colour_bars = 1, black = 5, noise = 21 };
    enum TimestampSource { end_of_frame = 0, start_of_exposure = 1 };
    static constexpr int no_text = 2;

    Vivid();
    Vivid(const Vivid&) = delete;
    Vivid& operator=(const Vivid&) = delete;
    ~Vivid();

    /// Paths of the nodes. Both hang on one platform device, so udev has one stable name for the two.
    const std::string& webcam() const { return webcam_; }
    const std::string& hdmi() const { return hdmi_; }

    /// Of the webcam, from outside the program under test. Also V4L2's own controls.
    void set(std::uint32_t control, int value) const;
    int get(std::uint32_t control) const;

private:
    std::string webcam_;
    std::string hdmi_;
};

}  // namespace darkbox::test
