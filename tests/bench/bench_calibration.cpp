// The simulated sweep over light calibration: how far the thesis' reading (brightest pixel, circle as found) and the
// joint refinement are off, and whether the reported covariances are honest. Prints two tables; takes no arguments.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "tests/processing/calibration/sweep.h"

namespace darkbox::test {
namespace {

using Lamps = SweepSetting::Lamps;

struct Family {
    std::string name;
    Lamps lamps;
    bool perspective;
    bool wall = true;
};
const std::vector<Family> families{{"distant, orthographic", Lamps::distant, false},
                                   {"distant, in a room", Lamps::distant, false, false},
                                   {"distant, perspective", Lamps::distant, true},
                                   {"near, two balls", Lamps::near_two_balls, false},
                                   {"near, two balls, perspective", Lamps::near_two_balls, true},
                                   {"near, one ball and the rig", Lamps::near_one_ball, false}};
const std::vector<double> full_wells{100000, 20000, 4000};  // electrons; fewer are noisier

void print_row(const std::string& name, const SweepSetting& s, const SweepErrors& e) {
    fmt::print("{:<30} {:>6.0f} {:>9.0f} {:>6} {:>8.3f} {:>8.3f} {:>6.2f} {:>7}\n", name, s.radius_px,
               s.noise.full_well_e, s.lights, e.raw_median(), e.refined_median(), e.refined_median() / e.raw_median(),
               e.unread);
    std::fflush(stdout);
}

/// Errors over radii, noise and number of lights, for one kind of lamps and camera.
SweepErrors sweep_family(const Family& family) {
    SweepErrors all;
    const auto run = [&](double radius, double full_well, int lights, double lamp_radiance) {
        SweepSetting setting;
        setting.radius_px = radius;
        setting.noise.full_well_e = full_well;
        setting.noise.seed = static_cast<std::uint64_t>(radius + full_well + lights);
        setting.lights = lights;
        setting.lamps = family.lamps;
        setting.perspective = family.perspective;
        setting.wall = family.wall;
        setting.lamp_radiance = lamp_radiance;
        setting.captures = lights > 24 ? 1 : 3;
        const SweepErrors errors = sweep(setting);
        print_row(family.name + (lamp_radiance > 1 ? ", clipped" : ""), setting, errors);
        gather(all, errors);
    };
    for (const double radius : {20.0, 40.0, 60.0, 90.0, 120.0}) run(radius, 20000, 12, 0.9);
    for (const double full_well : full_wells) run(60, full_well, 12, 0.9);
    for (const int lights : {9, 24, 64}) run(60, 20000, lights, 0.9);
    run(60, 20000, 12, 4);
    return all;
}

void print_honesty(const std::string& name, const SweepErrors& errors) {
    fmt::print("{:<30} {:>6}", name, errors.chi_squared.size());
    for (const double p : {0.5, 0.9, 0.95}) fmt::print(" {:>7.1f}", 100 * errors.share_below(p));
    fmt::print("\n");
}

int run() {
    fmt::print("Light directions at the object, degrees; raw: brightest pixel; full well in electrons\n");
    fmt::print("{:<30} {:>6} {:>9} {:>6} {:>8} {:>8} {:>6} {:>7}\n", "lamps, camera", "radius", "full well", "lights",
               "raw", "refined", "ratio", "unread");
    std::vector<SweepErrors> all;
    for (const Family& family : families) all.push_back(sweep_family(family));
    fmt::print("\nHonesty: share of errors below the 50, 90 and 95 % points of chi-squared with two degrees\n");
    fmt::print("{:<30} {:>6} {:>7} {:>7} {:>7}\n", "lamps, camera", "n", "50 %", "90 %", "95 %");
    for (std::size_t i = 0; i < families.size(); ++i) print_honesty(families[i].name, all[i]);
    return 0;
}

}  // namespace
}  // namespace darkbox::test

int main() { return darkbox::test::run(); }
