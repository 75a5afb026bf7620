#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "acquisition/frame/units.h"
#include "rig/description/health_description.h"
#include "rig/description/retention_rules.h"

namespace darkbox {

/// What light does to an object: it adds up and never fades.
struct LightDose {
    double lux_s = 0;        ///< visible light, lux seconds
    double uv_j_per_m2 = 0;  ///< ultraviolet
    double ir_j_per_m2 = 0;  ///< infrared
};

/// [dose]: how much light an object may be given. What is not limited is counted all the same.
struct DoseDescription {
    std::optional<double> object_lux_s;  ///< over all of an object's captures
    std::optional<double> object_uv_j_per_m2;
    std::optional<double> object_ir_j_per_m2;
    std::optional<double> capture_lux_s;               ///< in one capture
    std::vector<std::string> exempt{"recalibration"};  ///< objects that bear any light, such as the mirror ball
};

/// One lamp of the rig as rig.toml describes it. Its LampId is its place in RigDescription::lamps.
struct LampDescription {
    std::string name;                     ///< unique
    int channel = -1;                     ///< driver "usb" and "sim"
    std::string line;                     ///< driver "gpio", wired directly: name or offset
    bool active_low = false;              ///< of that line
    int address = -1;                     ///< driver "gpio", multiplexed: what the decoder turns into this lamp
    std::array<double, 3> position_mm{};  ///< rig frame: x right, y up, z to the camera, origin at the object
    Seconds max_on{2.0};                  ///< longest continuous on-time
    double max_duty = 0.5;                ///< driver "usb": share of a long time that it may shine
    Seconds settle{0.005};                ///< from switch to steady light
    LightDose dose_per_s;                 ///< what it gives the object in a second; 0: not known
};

/// A binary decoder between few lines and many lamps.
struct MultiplexerDescription {
    std::vector<std::string> address_lines;  ///< names or offsets, lowest bit first
    std::string enable_line;                 ///< every lamp is dark while it is inactive
    bool enable_active_low = false;
};

/// [lamps.gpio], of driver "gpio".
struct GpioDescription {
    std::string chip;                                   ///< its label
    std::optional<MultiplexerDescription> multiplexer;  ///< none: one line a lamp
};

/// [door]: a switch that tells whether the box is open.
struct DoorDescription {
    std::string chip;         ///< label of the GPIO chip; empty with a simulated camera, whose door is simulated, too
    std::string line;         ///< name or offset
    bool active_low = false;  ///< the door is open while the line is low
};

/// [lamps.usb], of driver "usb".
struct UsbDescription {
    std::string serial;      ///< empty: the only lamp controller there is
    Seconds heartbeat{1.0};  ///< silence after which the controller darkens the lamps
};

struct CameraDescription {
    std::string driver = "sim";              ///< "v4l2" or "sim"
    std::string device;                      ///< v4l2: stable id or path
    std::string format;                      ///< v4l2: its four characters, "Y16"; empty: the camera's best
    int width = 0;                           ///< v4l2: pixels; 0 with height: the camera's largest picture
    int height = 0;                          ///< v4l2: pixels
    std::optional<double> frame_rate;        ///< v4l2: per second; none: the fastest that holds the exposure
    std::optional<std::array<int, 4>> crop;  ///< v4l2: left, top, width, height on the sensor
    Seconds exposure{0.02};
    double gain = 1.0;
    std::optional<double> mm_per_pixel;                 ///< [camera.intrinsics], at the object
    std::optional<double> distance_mm;                  ///< from the object; none: orthographic
    std::optional<std::array<double, 2>> principal_px;  ///< none: the picture's centre
};

/// How lamps and exposures are kept together.
enum class SyncMode {
    settled,     ///< switch, wait for the first frame that begins after it: two frame periods a lamp or more
    predictive,  ///< switch in the gap between exposures, found from the timestamps: one frame period a lamp
    strobed,     ///< the lamp controller steps at the camera's strobe: one frame period a lamp
};
std::string_view name(SyncMode mode);
std::optional<SyncMode> sync_mode_from_name(std::string_view name);

struct CaptureDescription {
    SyncMode mode = SyncMode::settled;
    bool metered = false;  ///< exposure = "metered": found before each capture; else exposure_ms of [camera]
    bool ambient = false;  ///< the room's light is not kept out: frames without a lamp are of kind ambient
    int dark_every = 0;    ///< lit frames after which one without a lamp comes; 0: at both ends only
    int averages = 1;      ///< frames of every lamp at every exposure
    std::vector<double> brackets{1.0};  ///< exposures of every lamp, as multiples of the one exposure
    bool closing_repeat = false;        ///< the first lamp once more at the end: shows what moved
    Seconds frame_deadline{5.0};        ///< the longest wait for one frame
    int tries = 3;                      ///< per shot, before the session fails
    double min_signal = 0.002;          ///< a lit frame's mean must exceed the dark frame's by this share of full scale
    bool lamp_places = true;            ///< the mirror ball is to show every lamp where it is known to stand
    double max_dark = 0.01;             ///< a dark frame's mean may exceed the black level by this share of full scale
};

/// Options of the simulated rig; see sim/ for the scenes.
struct SimDescription {
    std::string scene = "brick-torus";
    int width = 320;                  ///< pixels
    int height = 240;                 ///< pixels
    double camera_distance_mm = 800;  ///< [camera.intrinsics] distance_mm; of perspective scenes
    std::string colour = "rgb";       ///< a pixel's samples: "rgb"; one, "grey"; or one behind a mosaic, "rggb"
    int bit_depth = 12;
    double full_well_e = 20000;  ///< electrons at full scale
    double read_noise_e = 5;     ///< electrons, standard deviation
    int latency_frames = 1;
    int queue_depth = 2;
    std::uint64_t seed = 1;
    double room_light = 0;                ///< what the room adds: this share of every lamp's light, always
    bool real_time = false;               ///< virtual time otherwise
    bool quick_noise = false;             ///< noise drawn from a table: a frame costs milliseconds
    std::string faults{};                 ///< what is to go wrong; see sim/faults.h
    std::filesystem::path lamps_seen{};   ///< the camera sees the lamps that this file tells of, not simulated ones
    std::filesystem::path strobe_line{};  ///< with lamps_seen: where the camera's strobe line is told
};

/// A rig.toml, parsed and valid. Plain data.
struct RigDescription {
    std::string name;
    CameraDescription camera;
    std::string lamps_driver = "sim";  ///< "gpio", "usb" or "sim"
    GpioDescription gpio;
    UsbDescription usb;
    std::vector<LampDescription> lamps;
    bool distant_lamps = false;        ///< their light is parallel: behind collimators, or simulated so
    std::optional<double> flicker_hz;  ///< of the lamps' light (PWM, mains): exposures are whole numbers of its periods
    std::optional<double> ball_diameter_mm;
    DoseDescription dose;
    std::optional<DoorDescription> door;
    HealthDescription health;
    CaptureDescription capture;
    SimDescription sim;
    std::filesystem::path sessions_folder;  ///< [api] sessions; empty = the caller's default
    std::filesystem::path socket;           ///< [api] socket; empty = the caller's default
    std::string socket_group;               ///< [api] group: whose members may use the socket; empty = only the owner
    std::string listen;                     ///< [api] listen: "127.0.0.1:7640"; empty = no TCP
    std::filesystem::path token_file;       ///< [api] token_file, for TCP; empty = beside the socket
    std::filesystem::path certificate;      ///< [api] certificate, PEM; empty = TCP without TLS, on loopback only
    std::filesystem::path key;              ///< [api] key, PEM; empty as the certificate is
    std::optional<RetentionRules> retention = {};  ///< none: sessions are never removed
    std::string toml;                              ///< the text it came from, byte for byte
};

/// Strict: an unknown key or a wrong type is an InputError that names the line and the nearest known key; a value out
/// of range names the field, the value and the allowed range. `origin` names the file in messages.
RigDescription parse_rig(const std::string& toml, const std::string& origin);
RigDescription load_rig(const std::filesystem::path& file);

/// The built-in simulated rig with this many lamps on a dome; `./run demo` uses 12. Round-trips through parse_rig().
std::string simulated_rig_toml(int lamps);

}  // namespace darkbox
