#include "rig/description/rig_description.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "acquisition/frame/error.h"
#include "rig/description/api_section.h"
#include "rig/description/camera_section.h"
#include "rig/description/capture_section.h"
#include "rig/description/door_section.h"
#include "rig/description/dose_section.h"
#include "rig/description/health_section.h"
#include "rig/description/lamps_section.h"
#include "rig/description/retention_section.h"
#include "rig/description/sim_section.h"
#include "rig/description/toml_section.h"

namespace darkbox {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest_file = 1 << 20;  ///< bytes; 64 lamps need about 6000

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
