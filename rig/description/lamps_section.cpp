#include "rig/description/lamps_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "rig/description/gpio_section.h"
#include "rig/description/lamp_section.h"
#include "rig/description/sim_section.h"
#include "rig/description/usb_section.h"

namespace darkbox {
namespace {

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

}  // namespace

void read_lamps(TomlSection& section, RigDescription& rig) {
    section.allow({"driver", "distant", "flicker_hz", "gpio", "usb", "lamp"});
    rig.lamps_driver = section.choice("driver", rig.lamps_driver, {"gpio", "usb", "sim"});
    const bool simulated_distant = rig.lamps_driver == "sim" && !is_word_of_scene(rig.sim.scene, "near");
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

}  // namespace darkbox
