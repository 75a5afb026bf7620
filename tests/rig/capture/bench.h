#pragma once

#include <gmock/gmock.h>

#include <stop_token>
#include <string>
#include <vector>

#include "acquisition/session/frame_file.h"
#include "rig/capture/capture_session.h"
#include "tests/rig/capture/fake_rig.h"
#include "tests/support/test_data.h"

namespace darkbox::test {

/// Four lamps, a camera, a clock and a folder for the session.
struct Bench {
    static constexpr std::size_t lamp_count = 4;
    static constexpr std::size_t shots = lamp_count + 2;

    TemporaryFolder folder;
    RigDescription rig = parse_rig(simulated_rig_toml(lamp_count), "rig.toml");
    FakeClock clock;
    FakeLamps lamps{clock, lamp_count};
    FakeCamera camera{clock, lamps};
    std::stop_source stop;

    CaptureRequest request(CaptureStart start = CaptureStart::create) const {
        return {folder.path() / "session", "a cat", {}, start};
    }
    Session capture(CaptureStart start = CaptureStart::create) {
        WorkContext work;
        work.stop = stop.get_token();
        return capture_session(request(start), rig, lamps, camera, clock, work).session;
    }
    /// A capture that is stopped while the n-th lamp is lit, and may be gone on with.
    void interrupt_at_lamp(int n) {
        int lit = 0;
        lamps.hook = [&, n](const std::string& call) {
            if (call == "light" && ++lit == n) stop.request_stop();
        };
        error<Cancelled>();
        stop = std::stop_source();
        lamps.hook = {};
    }
    /// What capture() says when it fails with this kind of error.
    template <typename Kind>
    std::string error(CaptureStart start = CaptureStart::create) {
        try {
            capture(start);
        } catch (const Kind& error) {
            EXPECT_FALSE(error.hint().empty());
            return error.what();
        } catch (const std::exception& other) {
            return std::string("another kind of error: ") + other.what();
        }
        return "no error";
    }
};

inline std::vector<std::string> files_of(const Session& session) {
    std::vector<std::string> files;
    for (const FrameRecord& record : session.frames()) files.push_back(record.file);
    return files;
}

/// Every frame of the session was lit by its lamp, by all of it and by nothing else, as its own pixels tell.
inline void expect_every_frame_right(const Session& session, const RigDescription& rig) {
    session.verify();
    ASSERT_EQ(session.frames().size(), rig.lamps.size() + 2);
    for (const FrameRecord& record : session.frames()) {
        const Frame frame = read_frame(session.path_of(record), record);
        const std::vector<double> shares = lamps_in(frame, rig.lamps.size());
        for (std::uint32_t lamp = 0; lamp < shares.size(); ++lamp)
            EXPECT_NEAR(shares[lamp], record.lamp == LampId{lamp} ? 1.0 : 0.0, 0.02)
                << "lamp " << lamp << " in " << record.file;
        EXPECT_TRUE(record.verified) << record.file;
        EXPECT_FALSE(record.verification.empty()) << record.file;
    }
}

/// All that the session notes, line by line.
inline std::string events_of(const Session& session) {
    std::string text;
    for (const SessionEvent& event : session.events()) text += event.what + "\n";
    return text;
}

}  // namespace darkbox::test
