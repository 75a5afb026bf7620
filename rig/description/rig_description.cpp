#include "rig/description/rig_description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "acquisition/frame/error.h"
#include "rig/description/capture_section.h"
#include "rig/description/dose_section.h"
#include "rig/description/health_section.h"
#include "rig/description/toml_section.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_file = 1 << 20;  ///< bytes; 64 lamps need about 6000
constexpr std::size_t most_lamps = 64;
constexpr std::size_t longest_name = 64;
constexpr std::size_t most_address_lines = 6;
constexpr double nearest_lamp_mm = 10;
constexpr double farthest_lamp_mm = 100'000;
constexpr double farthest_principal_px = 100'000;
constexpr double intrinsics_agree_within = 0.01;
constexpr double longest_usb_on_s = 60;
constexpr std::size_t longest_usb_serial = 12;

Seconds milliseconds(double ms) { return Seconds(ms / 1000.0); }
double as_milliseconds(Seconds s) { return s.count() * 1000.0; }

bool is_file_name_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
}

/// Lamp names become part of file names.
bool is_lamp_name(const std::string& name) {
    return !name.empty() && name.size() <= longest_name && name.front() != '.' &&
           std::all_of(name.begin(), name.end(), is_file_name_character);
}

std::array<double, 3> read_position(TomlSection& section) {
    const auto read = section.numbers("position_mm", 3);
    if (!read)
        section.fail("position_mm", "position_mm is missing",
                     "add position_mm = [x, y, z]: x right, y up, z to the camera, from the object");
    const std::array<double, 3> position{(*read)[0], (*read)[1], (*read)[2]};
    const double distance = std::hypot(position[0], position[1], position[2]);
    if (distance < nearest_lamp_mm || distance > farthest_lamp_mm)
        section.fail("position_mm",
                     fmt::format("position_mm is {} mm from the object; allowed: {} to {}", distance, nearest_lamp_mm,
                                 farthest_lamp_mm),
                     "give the position in millimetres, measured from the object");
    return position;
}

std::string read_lamp_name(TomlSection& section) {
    std::string name = section.required_text("name");
    if (!is_lamp_name(name))
        section.fail("name", fmt::format("name '{}' cannot be part of a file name", name.substr(0, longest_name)),
                     fmt::format("use 1 to {} letters, digits, '-', '_' or '.', not starting with '.'", longest_name));
    return name;
}

/// The key that says which output of the driver a lamp hangs on.
std::string output_key(const RigDescription& rig) {
    if (rig.lamps_driver != "gpio") return "channel";
    return rig.gpio.multiplexer ? "address" : "line";
}

std::string driver_in_words(const RigDescription& rig) {
    return fmt::format("driver \"{}\"{}", rig.lamps_driver, rig.gpio.multiplexer ? " with a multiplexer" : "");
}

void read_output(TomlSection& section, const RigDescription& rig, bool active_low, LampDescription& lamp) {
    const std::int64_t addresses =
        rig.gpio.multiplexer ? std::int64_t{1} << rig.gpio.multiplexer->address_lines.size() : most_lamps;
    const auto line = section.text_or_digits("line");
    const auto channel = section.integer("channel", {0, static_cast<std::int64_t>(most_lamps) - 1});
    const auto address = section.integer("address", {0, addresses - 1});
    const std::string wanted = output_key(rig);
    for (const char* other : {"channel", "line", "address"})
        if (other != wanted && section.has(other))
            section.fail(other, fmt::format("{} does not belong to {}", other, driver_in_words(rig)),
                         fmt::format("name the lamp's output with {}", wanted));
    if (!section.has(wanted) || (line && line->empty()))
        section.fail(wanted, fmt::format("{} is missing; {} needs it", wanted, driver_in_words(rig)),
                     fmt::format("add {} to the lamp", wanted));
    if (wanted != "line" && section.has("active_low"))
        section.fail("active_low", "active_low belongs to a lamp with a line of its own",
                     "remove it; a decoder's enable line has enable_active_low");
    lamp.line = line.value_or("");
    lamp.active_low = section.flag("active_low").value_or(active_low);
    lamp.channel = static_cast<int>(channel.value_or(-1));
    lamp.address = static_cast<int>(address.value_or(-1));
}

LampDescription read_lamp(TomlSection& section, const RigDescription& rig, bool active_low) {
    LampDescription lamp;
    std::set<std::string> keys{"name",        "line",     "active_low", "address",  "channel",
                               "position_mm", "max_on_s", "max_duty",   "settle_ms"};
    keys.insert(lamp_dose_keys.begin(), lamp_dose_keys.end());
    section.allow(keys);
    lamp.dose_per_s = read_lamp_dose(section);
    lamp.name = read_lamp_name(section);
    const Seconds exposure = rig.camera.exposure;
    read_output(section, rig, active_low, lamp);
    lamp.position_mm = read_position(section);
    lamp.max_on = Seconds(section.number("max_on_s", {0.001, 600}).value_or(lamp.max_on.count()));
    if (section.has("max_duty") && rig.lamps_driver != "usb")
        section.fail("max_duty", fmt::format("max_duty does not belong to driver \"{}\"", rig.lamps_driver),
                     "leave it out: only the USB lamp controller keeps to it");
    lamp.max_duty = section.number("max_duty", {0.02, 0.79}).value_or(lamp.max_duty);
    if (rig.lamps_driver == "usb" && lamp.max_on.count() > longest_usb_on_s)
        section.fail(
            "max_on_s",
            fmt::format("max_on_s is {}; allowed with driver \"usb\": up to {}", lamp.max_on.count(), longest_usb_on_s),
            "lower max_on_s: the USB lamp controller lets no lamp shine longer");
    lamp.settle = milliseconds(section.number("settle_ms", {0, 10'000}).value_or(as_milliseconds(lamp.settle)));
    if (lamp.max_on <= lamp.settle + exposure)
        section.fail("max_on_s",
                     fmt::format("max_on_s is {}; allowed: more than settle_ms and exposure_ms together ({} ms)",
                                 lamp.max_on.count(), as_milliseconds(lamp.settle + exposure)),
                     "raise max_on_s, or shorten exposure_ms of [camera]");
    return lamp;
}

/// A scene's name is words joined by '-'.
bool has_word(const std::string& scene, const std::string& word) {
    return ("-" + scene + "-").find("-" + word + "-") != std::string::npos;
}

/// `output` is what two lamps may not share, such as their name.
template <typename Output>
void refuse_duplicate(const std::vector<LampDescription>& lamps, Output output, const TomlSection& section,
                      const std::string& key) {
    const auto same = [&](const LampDescription& lamp) { return output(lamp) == output(lamps.back()); };
    const auto earlier = std::find_if(lamps.begin(), lamps.end() - 1, same);
    if (earlier == lamps.end() - 1) return;
    section.fail(key,
                 fmt::format("{} '{}' of lamp '{}' is taken by lamp {} ('{}')", key, output(lamps.back()),
                             lamps.back().name, earlier - lamps.begin() + 1, earlier->name),
                 fmt::format("give every lamp a {} of its own", key));
}

MultiplexerDescription read_multiplexer(TomlSection& section) {
    MultiplexerDescription decoder;
    section.allow({"address_lines", "enable_line", "enable_active_low"});
    decoder.address_lines = section.texts_or_digits("address_lines");
    if (decoder.address_lines.empty() || decoder.address_lines.size() > most_address_lines)
        section.fail("address_lines",
                     fmt::format("address_lines names {} lines; allowed: 1 to {}", decoder.address_lines.size(),
                                 most_address_lines),
                     "name the decoder's address lines, lowest bit first");
    decoder.enable_line = section.text_or_digits("enable_line").value_or("");
    if (decoder.enable_line.empty())
        section.fail("enable_line", "enable_line is missing; without it some lamp is always lit",
                     "wire the decoder's enable input to a line and name it");
    std::vector<std::string> lines = decoder.address_lines;
    lines.push_back(decoder.enable_line);
    std::sort(lines.begin(), lines.end());
    const auto twice = std::adjacent_find(lines.begin(), lines.end());
    if (twice != lines.end())
        section.fail("address_lines", fmt::format("line '{}' is named twice", *twice),
                     "give every input of the decoder a line of its own");
    decoder.enable_active_low = section.flag("enable_active_low").value_or(false);
    return decoder;
}

/// Returns whether lamps are active low that do not say so themselves.
bool read_gpio(TomlSection& section, GpioDescription& gpio) {
    section.allow({"chip", "active_low", "multiplexer"});
    gpio.chip = section.required_text("chip");
    if (auto decoder = section.section("multiplexer", "[lamps.gpio.multiplexer]")) {
        gpio.multiplexer = read_multiplexer(*decoder);
        if (section.has("active_low"))
            section.fail("active_low", "active_low is for lamps with lines of their own",
                         "remove it; a decoder's enable line has enable_active_low");
    }
    return section.flag("active_low").value_or(false);
}

UsbDescription read_usb(TomlSection& section) {
    section.allow({"serial", "heartbeat_ms"});
    UsbDescription usb;
    usb.serial = section.text("serial").value_or("");
    if (usb.serial.size() > longest_usb_serial)
        section.fail("serial",
                     fmt::format("serial has {} characters; allowed: up to {}", usb.serial.size(), longest_usb_serial),
                     "darkbox lamps list --boards lists the serials of the lamp controllers");
    usb.heartbeat = milliseconds(section.number("heartbeat_ms", {50, 1000}).value_or(as_milliseconds(usb.heartbeat)));
    return usb;
}

void read_lamps(TomlSection& section, RigDescription& rig) {
    section.allow({"driver", "distant", "flicker_hz", "gpio", "usb", "lamp"});
    rig.lamps_driver = section.choice("driver", rig.lamps_driver, {"gpio", "usb", "sim"});
    const bool simulated_distant = rig.lamps_driver == "sim" && !has_word(rig.sim.scene, "near");
    rig.distant_lamps = section.flag("distant").value_or(simulated_distant);
    rig.flicker_hz = section.number("flicker_hz", {1, 1'000'000});
    bool active_low = false;
    auto gpio = section.section("gpio", "[lamps.gpio]");
    if (gpio && rig.lamps_driver != "gpio")
        section.fail("gpio", fmt::format("has [lamps.gpio], but driver \"{}\"", rig.lamps_driver),
                     "remove [lamps.gpio], or write driver = \"gpio\"");
    if (gpio) active_low = read_gpio(*gpio, rig.gpio);
    auto usb = section.section("usb", "[lamps.usb]");
    if (usb && rig.lamps_driver != "usb")
        section.fail("usb", fmt::format("has [lamps.usb], but driver \"{}\"", rig.lamps_driver),
                     "remove [lamps.usb], or write driver = \"usb\"");
    if (usb) rig.usb = read_usb(*usb);
    std::vector<TomlSection> lamps = section.sections("lamp", "[[lamps.lamp]]");
    if (lamps.empty()) section.fail("lamp", "holds no lamp; allowed: 1 to 64", "add a [[lamps.lamp]] for each lamp");
    for (TomlSection& lamp : lamps) {
        if (rig.lamps.size() == most_lamps)
            lamp.fail("name", fmt::format("is one of {} lamps; allowed: 1 to {}", lamps.size(), most_lamps),
                      "describe at most 64 lamps");
        rig.lamps.push_back(read_lamp(lamp, rig, active_low));
        refuse_duplicate(rig.lamps, [](const LampDescription& l) { return l.name; }, lamp, "name");
        const std::string key = output_key(rig);
        const auto output = [&](const LampDescription& l) {
            return key == "line" ? l.line : std::to_string(key == "address" ? l.address : l.channel);
        };
        refuse_duplicate(rig.lamps, output, lamp, key);
    }
    if (rig.lamps_driver == "gpio" && !gpio)
        section.fail("gpio", "has driver \"gpio\" but no [lamps.gpio]",
                     "add [lamps.gpio] with chip = \"LABEL\" (gpiodetect lists the labels)");
}

/// Two of scale, distance and focal length tell the third: distance = focal length times scale.
void read_intrinsics(TomlSection& section, CameraDescription& camera) {
    section.allow({"mm_per_pixel", "distance_mm", "focal_length_px", "principal_px"});
    camera.mm_per_pixel = section.number("mm_per_pixel", {0.0001, 100});
    camera.distance_mm = section.number("distance_mm", {1, 1'000'000});
    const auto focal_length = section.number("focal_length_px", {1, 10'000'000});
    if (const auto point = section.numbers("principal_px", 2)) {
        camera.principal_px = {(*point)[0], (*point)[1]};
        for (const double coordinate : *point)
            if (std::abs(coordinate) > farthest_principal_px)
                section.fail("principal_px",
                             fmt::format("principal_px has {}; allowed: {} to {}", coordinate, -farthest_principal_px,
                                         farthest_principal_px),
                             "give the pixel at which the optical axis meets the picture: u right, v down");
    }
    if (camera.distance_mm && !camera.mm_per_pixel && !focal_length)
        section.fail("distance_mm", "distance_mm needs mm_per_pixel or focal_length_px beside it",
                     "add the scale at the object");
    if (!focal_length) return;
    if (camera.distance_mm && camera.mm_per_pixel) {
        const double told = *focal_length * *camera.mm_per_pixel;
        if (std::abs(told - *camera.distance_mm) > intrinsics_agree_within * *camera.distance_mm)
            section.fail("focal_length_px",
                         fmt::format("focal_length_px times mm_per_pixel is {:.1f} mm, but distance_mm is {:.1f}", told,
                                     *camera.distance_mm),
                         "give two of the three, or values that agree");
    } else if (camera.mm_per_pixel) {
        camera.distance_mm = *focal_length * *camera.mm_per_pixel;
    } else if (camera.distance_mm) {
        camera.mm_per_pixel = *camera.distance_mm / *focal_length;
    } else {
        section.fail("focal_length_px", "focal_length_px needs mm_per_pixel or distance_mm beside it",
                     "add the scale at the object, or the camera's distance from it");
    }
}

/// What is asked of a real camera's picture; a simulated one takes it from [sim].
void read_mode(TomlSection& section, CameraDescription& camera) {
    constexpr std::array keys{"format", "width", "height", "frame_rate", "crop"};
    for (const char* key : keys)
        if (section.has(key) && camera.driver != "v4l2")
            section.fail(key, fmt::format("{} does not belong to driver \"{}\"", key, camera.driver),
                         "leave it out, or set driver = \"v4l2\"");
    camera.format = section.text("format").value_or("");
    camera.width = static_cast<int>(section.integer("width", {1, 65'535}).value_or(0));
    camera.height = static_cast<int>(section.integer("height", {1, 65'535}).value_or(0));
    if ((camera.width == 0) != (camera.height == 0))
        section.fail(camera.width == 0 ? "height" : "width", "has one of width and height",
                     "give both, or neither for the largest picture");
    camera.frame_rate = section.number("frame_rate", {0.01, 10'000});
    if (const auto crop = section.numbers("crop", 4)) {
        camera.crop.emplace();
        for (std::size_t i = 0; i < crop->size(); ++i) {
            const double edge = (*crop)[i];
            if (edge < (i < 2 ? 0 : 1) || edge > 65'535 || edge != std::floor(edge))
                section.fail("crop",
                             fmt::format("crop holds {}; allowed: whole numbers up to 65535, a size from 1", edge),
                             "give left, top, width and height in pixels of the sensor");
            (*camera.crop)[i] = static_cast<int>(edge);
        }
    }
}

CameraDescription read_camera(TomlSection& section) {
    CameraDescription camera;
    section.allow(
        {"driver", "device", "format", "width", "height", "frame_rate", "crop", "exposure_ms", "gain", "intrinsics"});
    camera.driver = section.choice("driver", camera.driver, {"v4l2", "sim"});
    camera.device = section.text("device").value_or("");
    camera.exposure =
        milliseconds(section.number("exposure_ms", {0.001, 60'000}).value_or(as_milliseconds(camera.exposure)));
    camera.gain = section.number("gain", {0.001, 1000}).value_or(camera.gain);
    read_mode(section, camera);
    if (auto intrinsics = section.section("intrinsics", "[camera.intrinsics]")) read_intrinsics(*intrinsics, camera);
    if (camera.driver == "v4l2" && camera.device.empty())
        section.fail("device", "device is missing; driver \"v4l2\" needs it",
                     "add device = \"/dev/v4l/by-id/...\" (ls /dev/v4l/by-id)");
    return camera;
}

DoorDescription read_door(TomlSection& section, const RigDescription& rig) {
    section.allow({"chip", "line", "active_low"});
    DoorDescription door;
    const bool simulated = rig.camera.driver == "sim";
    for (const char* key : {"chip", "line", "active_low"})
        if (simulated && section.has(key))
            section.fail(key, fmt::format("{} does not belong to a simulated rig's door", key),
                         "leave it out: [sim] faults opens the door");
    door.chip = section.text("chip").value_or(rig.gpio.chip);
    door.line = section.text_or_digits("line").value_or("");
    door.active_low = section.flag("active_low").value_or(false);
    if (!simulated && door.chip.empty())
        section.fail("chip", "chip is missing", "give the GPIO chip's label (gpiodetect lists the labels)");
    if (!simulated && door.line.empty())
        section.fail("line", "line is missing", "name the line that the door's switch hangs on");
    return door;
}

SimDescription read_sim(TomlSection& section) {
    SimDescription sim;
    section.allow({"scene", "width", "height", "colour", "bit_depth", "full_well_e", "read_noise_e", "latency_frames",
                   "queue_depth", "seed", "room_light", "real_time", "quick_noise", "faults", "lamps_seen",
                   "strobe_line"});
    const auto whole = [&](const char* key, Allowed<std::int64_t> allowed, int fallback) {
        return static_cast<int>(section.integer(key, allowed).value_or(fallback));
    };
    if (section.has("scene")) sim.scene = section.required_text("scene");
    sim.width = whole("width", {16, 8192}, sim.width);
    sim.height = whole("height", {16, 8192}, sim.height);
    sim.colour = section.choice("colour", sim.colour, {"rgb", "grey", "rggb"});
    sim.bit_depth = whole("bit_depth", {8, 16}, sim.bit_depth);
    sim.full_well_e = section.number("full_well_e", {100, 10'000'000}).value_or(sim.full_well_e);
    sim.read_noise_e = section.number("read_noise_e", {0, 1000}).value_or(sim.read_noise_e);
    sim.latency_frames = whole("latency_frames", {0, 16}, sim.latency_frames);
    sim.queue_depth = whole("queue_depth", {1, 32}, sim.queue_depth);
    sim.room_light = section.number("room_light", {0, 1}).value_or(sim.room_light);
    const auto any_seed = Allowed<std::int64_t>{0, std::numeric_limits<std::int64_t>::max()};
    sim.seed =
        static_cast<std::uint64_t>(section.integer("seed", any_seed).value_or(static_cast<std::int64_t>(sim.seed)));
    sim.real_time = section.flag("real_time").value_or(sim.real_time);
    sim.quick_noise = section.flag("quick_noise").value_or(sim.quick_noise);
    sim.faults = section.text("faults").value_or("");
    sim.lamps_seen = section.text("lamps_seen").value_or("");
    sim.strobe_line = section.text("strobe_line").value_or("");
    if (!sim.strobe_line.empty() && sim.lamps_seen.empty())
        section.fail("strobe_line", "has strobe_line without lamps_seen",
                     "remove it: simulated lamps hear the camera's strobe line without a file");
    if (!sim.lamps_seen.empty() && !sim.real_time)
        section.fail("lamps_seen", "has lamps_seen without real_time",
                     "add real_time = true: real lamps know no virtual time");
    return sim;
}

void read_api(TomlSection& section, RigDescription& rig) {
    section.allow({"sessions", "socket", "group", "listen", "token_file", "certificate", "key"});
    rig.sessions_folder = section.text("sessions").value_or("");
    rig.socket = section.text("socket").value_or("");
    rig.socket_group = section.text("group").value_or("");
    rig.listen = section.text("listen").value_or("");
    rig.token_file = section.text("token_file").value_or("");
    rig.certificate = section.text("certificate").value_or("");
    rig.key = section.text("key").value_or("");
    if (rig.certificate.empty() != rig.key.empty()) {
        const char* given = rig.key.empty() ? "certificate" : "key";
        const char* other = rig.key.empty() ? "key" : "certificate";
        section.fail(given, fmt::format("has {} without {}", given, other), "TLS needs both: name the two PEM files");
    }
}

RetentionRules read_retention(TomlSection& section) {
    section.allow({"keep_days", "keep_newest", "free_gb"});
    RetentionRules rules;
    const auto days = section.integer("keep_days", {1, 36'500});
    if (!days)
        section.fail("keep_days", "has no keep_days", "say for how many days sessions stay at least: keep_days = 90");
    rules.keep_days = static_cast<int>(*days);
    rules.keep_newest = static_cast<int>(section.integer("keep_newest", {0, 1'000'000}).value_or(0));
    rules.free_gb = section.number("free_gb", {0.001, 1e6});
    return rules;
}

/// The simulator draws from where the description says that the camera is, and the description of a perspective scene
/// tells the simulator's own place where it says nothing.
void settle_simulated_camera(RigDescription& rig) {
    if (rig.camera.driver != "sim") return;
    rig.sim.camera_distance_mm = rig.camera.distance_mm.value_or(rig.sim.camera_distance_mm);
    if (has_word(rig.sim.scene, "perspective")) rig.camera.distance_mm = rig.sim.camera_distance_mm;
}

RigDescription read_rig(TomlSection& root) {
    root.allow({"rig", "camera", "lamps", "ball", "door", "dose", "health", "capture", "processing", "api", "retention",
                "sim"},
               "section");
    RigDescription rig;
    if (auto section = root.section("rig", "[rig]")) {
        section->allow({"name"});
        rig.name = section->required_text("name");
    } else {
        root.fail("rig", "has no [rig]", "add [rig] with name = \"...\"");
    }
    if (auto section = root.section("camera", "[camera]")) rig.camera = read_camera(*section);
    auto lamps = root.section("lamps", "[lamps]");
    if (auto section = root.section("ball", "[ball]")) {
        section->allow({"diameter_mm"});
        rig.ball_diameter_mm = section->number("diameter_mm", {0.1, 10'000});
    }
    if (auto section = root.section("capture", "[capture]")) rig.capture = read_capture(*section);
    if (auto section = root.section("processing", "[processing]")) section->allow({});
    if (auto section = root.section("api", "[api]")) read_api(*section, rig);
    if (auto section = root.section("retention", "[retention]")) rig.retention = read_retention(*section);
    if (auto section = root.section("sim", "[sim]")) rig.sim = read_sim(*section);
    settle_simulated_camera(rig);
    if (!lamps) root.fail("lamps", "has no [lamps]", "add [lamps] with a [[lamps.lamp]] for each lamp");
    read_lamps(*lamps, rig);
    if (auto section = root.section("door", "[door]")) rig.door = read_door(*section, rig);
    if (auto section = root.section("health", "[health]")) rig.health = read_health(*section, rig.lamps_driver);
    if (auto section = root.section("dose", "[dose]")) rig.dose = read_dose(*section, rig.lamps);
    const bool sees_lamps = rig.camera.driver == "sim" && !rig.sim.lamps_seen.empty();
    if ((rig.camera.driver == "sim") != (rig.lamps_driver == "sim") && !sees_lamps)
        root.fail("lamps", fmt::format("has a \"{}\" camera and \"{}\" lamps", rig.camera.driver, rig.lamps_driver),
                  "a simulated camera sees simulated lamps only: make both \"sim\" or neither");
    if (sees_lamps && rig.lamps_driver != "usb")
        root.fail("sim", fmt::format("has lamps_seen, but \"{}\" lamps", rig.lamps_driver),
                  "remove it: an emulated USB lamp controller writes what it tells of");
    return rig;
}

void refuse_huge(std::uintmax_t size, const std::string& origin) {
    if (size <= largest_file) return;
    throw InputError(fmt::format("{}: the file has {} bytes; allowed: at most {}", origin, size, largest_file),
                     "a rig.toml of 64 lamps has about 6000 bytes: check that this is the right file");
}

}  // namespace

RigDescription parse_rig(const std::string& toml, const std::string& origin) {
    refuse_huge(toml.size(), origin);
    toml::table table;
    try {
        table = toml::parse(toml, origin);
    } catch (const toml::parse_error& error) {
        throw InputError(fmt::format("{}:{}: {}", origin, error.source().begin.line, error.description()),
                         "correct that line; https://toml.io describes the format");
    }
    TomlSection root(table, "the rig's description", origin);
    RigDescription rig = read_rig(root);
    rig.toml = toml;
    return rig;
}

RigDescription load_rig(const fs::path& file) {
    std::error_code error;
    if (!fs::is_regular_file(file, error))
        throw InputError(fmt::format("{}: there is no such file", file.string()),
                         "name a rig.toml, or start from one of the examples in rig/description/examples");
    refuse_huge(fs::file_size(file, error), file.string());
    std::ifstream in(file, std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(in), {});
    if (!in) throw InputError(fmt::format("{}: the file cannot be read", file.string()), "check its permissions");
    return parse_rig(text, file.string());
}

}  // namespace darkbox
