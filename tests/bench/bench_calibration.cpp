// The simulated sweep over light calibration: how far the thesis' reading (brightest pixel, circle as found) and the
// joint refinement are off, and whether the reported covariances are honest. Prints two tables; takes no arguments.

#include <fmt/format.h>
#include <tbb/task_group.h>

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

struct Row {
    SweepSetting setting;
    std::vector<SweepErrors> errors;  // one per full well
};

/// One axis at a time round 60 px and 12 lights: radii, then lights, then lamps that clip.
std::vector<Row> rows_of(const Family& family) {
    std::vector<Row> rows;
    const auto add = [&](double radius, int lights, int captures, double lamp_radiance) {
        SweepSetting setting;
        setting.radius_px = radius;
        setting.full_wells_e = full_wells;
        setting.seed = static_cast<std::uint64_t>(radius + lights);
        setting.lights = lights;
        setting.lamps = family.lamps;
        setting.perspective = family.perspective;
        setting.wall = family.wall;
        setting.lamp_radiance = lamp_radiance;
        setting.captures = captures;
        rows.push_back({setting, {}});
    };
    for (const double radius : {20.0, 40.0, 60.0}) add(radius, 12, 3, 0.9);
    for (const double radius : {90.0, 120.0}) add(radius, 12, 1, 0.9);
    for (const int lights : {9, 24}) add(60, lights, 2, 0.9);
    add(60, 64, 1, 0.9);
    add(60, 12, 2, 4);
    return rows;
}

/// Many scenes of one kind: the ball at 60 px under 9 distant lights.
SweepErrors honesty_of(bool wall) {
    SweepSetting setting;
    setting.full_wells_e = full_wells;
    setting.seed = 97;
    setting.lights = 9;
    setting.captures = 40;
    setting.wall = wall;
    SweepErrors all;
    for (const SweepErrors& level : sweep(setting)) gather(all, level);
    return all;
}

void print_row(const std::string& name, const Row& row) {
    const SweepSetting& s = row.setting;
    for (std::size_t level = 0; level < full_wells.size(); ++level) {
        const SweepErrors& e = row.errors[level];
        fmt::print("| {} | {:.0f} | {:.0f} | {} | {:.3f} | {:.3f} | {} |\n", name, s.radius_px, full_wells[level],
                   s.lights, e.raw_median(), e.refined_median(), e.unread);
    }
}

void print_honesty(const std::string& name, const SweepErrors& errors) {
    fmt::print("| {} | {} |", name, errors.chi_squared.size());
    for (const double p : {0.5, 0.9, 0.95}) fmt::print(" {:.1f} |", 100 * errors.share_below(p));
    fmt::print("\n");
}

int run() {
    std::vector<std::vector<Row>> tables;
    for (const Family& family : families) tables.push_back(rows_of(family));
    std::vector<SweepErrors> distant(2);
    tbb::task_group tasks;
    for (auto& table : tables)
        for (Row& row : table) tasks.run([&row] { row.errors = sweep(row.setting); });
    for (const std::size_t wall : {0U, 1U}) tasks.run([&distant, wall] { distant[wall] = honesty_of(wall == 1); });
    tasks.wait();

    fmt::print("Light directions at the object, median degrees; raw: brightest pixel; full well in electrons\n\n");
    fmt::print("| lamps, camera | radius px | full well e | lights | raw | refined | unread |\n");
    fmt::print("| --- | --- | --- | --- | --- | --- | --- |\n");
    for (std::size_t i = 0; i < families.size(); ++i)
        for (const Row& row : tables[i])
            print_row(families[i].name + (row.setting.lamp_radiance > 1 ? ", clipped" : ""), row);
    fmt::print("\nHonesty: share of errors below the 50, 90 and 95 % points of chi-squared with two degrees\n\n");
    fmt::print("| lights | errors | 50 % | 90 % | 95 % |\n| --- | --- | --- | --- | --- |\n");
    print_honesty("60 px, 40 captures before a wall", distant[1]);
    print_honesty("60 px, 40 captures in a room", distant[0]);
    for (std::size_t radius = 0; radius < 5; ++radius) {
        SweepErrors all;
        for (const auto& table : tables)
            for (const SweepErrors& level : table[radius].errors) gather(all, level);
        print_honesty(fmt::format("{:.0f} px, all of the table's kinds", tables[0][radius].setting.radius_px), all);
    }
    return 0;
}

}  // namespace
}  // namespace darkbox::test

int main() { return darkbox::test::run(); }
