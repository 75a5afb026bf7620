#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "acquisition/frame/error.h"
#include "acquisition/session/frame_file.h"
#include "acquisition/session/session_writer.h"
#include "tests/acquisition/session/test_frames.h"
#include "tests/support/test_data.h"

namespace darkbox::test {

inline std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

inline std::string read_file(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

inline void write_file(const std::filesystem::path& file, std::string_view text) {
    std::filesystem::remove(file);  // what is sealed is read-only
    std::ofstream(file, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

inline void copy_folder(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::filesystem::remove_all(to);
    std::filesystem::copy(from, to, std::filesystem::copy_options::recursive);
}

inline SessionInfo capture_info(int planned_shots) {
    SessionInfo info;
    info.object = "a brick";
    info.created = "2026-01-31T12:00:00.000Z";
    info.source = "capture";
    info.rig = "dome-12";
    info.camera = "sim 0001";
    info.planned_shots = planned_shots;
    info.notes = {"first note"};
    return info;
}

/// Frame `number` of a test session: its pixels follow from the number alone.
inline Frame numbered_frame(std::uint32_t number) { return noise_frame(PixelFormat::grey16, 16, 12, number); }

inline FrameRecord numbered_record(std::uint32_t number) {
    FrameRecord record;
    record.lamp = LampId{number};
    record.lamp_name = "lamp-" + std::to_string(number);
    record.lamp_on_ns = 1000 + number;
    record.lamp_off_ns = 2000 + number;
    record.verified = true;
    record.verification = "brighter than dark by 0.25";
    return record;
}

inline void add_numbered(SessionWriter& writer, std::uint32_t number) {
    writer.add(numbered_frame(number), numbered_record(number));
}

/// True when the frame with this record is bit for bit the numbered frame that its sequence tells.
inline bool has_right_bits(const std::filesystem::path& folder, const FrameRecord& record) {
    const Frame back = read_frame(folder / "data" / record.file, record);
    return back.pixels == numbered_frame(static_cast<std::uint32_t>(record.sequence)).pixels;
}

/// A session of `frames` frames, rig.toml and a mask, ready to be sealed.
inline SessionWriter written_session(const std::filesystem::path& folder, std::uint32_t frames) {
    SessionWriter writer = SessionWriter::create(folder, capture_info(static_cast<int>(frames)));
    writer.add_extra("rig.toml", bytes_of("[rig]\nname = \"dome-12\"\n"));
    for (std::uint32_t i = 0; i < frames; ++i) add_numbered(writer, i);
    writer.add_extra("masks/mask.png", bytes_of("not really a picture"));
    writer.note_event("lamp-3 taken again");
    writer.add_note("second note");
    return writer;
}

/// what() and hint() of the E thrown by `action`; empty when it throws none. Any other exception passes.
template <typename E>
std::string failure_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const E& error) {
        return std::string(error.what()) + " | " + error.hint();
    }
    return {};
}

}  // namespace darkbox::test
