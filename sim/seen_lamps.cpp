#include "sim/seen_lamps.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <string>

#include "acquisition/device/device_error.h"

namespace darkbox::sim {
namespace {

constexpr double full_level = 255.0;

}  // namespace

SeenLamps::SeenLamps(const RigDescription& rig) : file_(rig.sim.lamps_seen), strobe_line_(rig.sim.strobe_line) {
    for (const LampDescription& lamp : rig.lamps) channels_.push_back(lamp.channel);
}

std::vector<LampShare> SeenLamps::burning_during(const Interval& interval) const {
    read_on();
    return sim::burning_during(history_, interval);
}

void SeenLamps::strobe_runs(TimePoint first, Nanoseconds period, Nanoseconds exposed) {
    if (strobe_line_.empty()) return;
    std::ofstream out(strobe_line_, std::ios::app);
    out << fmt::format("{} {} {}\n", first.time_since_epoch().count(), period.count(), exposed.count()) << std::flush;
    if (!out)
        throw DeviceError(fmt::format("{}: the strobe line cannot be written", strobe_line_.string()),
                          "check sim.strobe_line in rig.toml");
}

/// Whole lines only: the last one may still be written.
void SeenLamps::read_on() const {
    std::ifstream in(file_, std::ios::binary);
    if (!in)
        throw DeviceError(fmt::format("{}: the file that tells of the lamps is not there", file_.string()),
                          "start the emulated lamp controller that writes it");
    in.seekg(read_);
    for (std::string line; std::getline(in, line) && !in.eof();) {
        read_ += static_cast<std::streamoff>(line.size()) + 1;
        std::istringstream words(line);
        Nanoseconds::rep when = 0;
        std::uint64_t lit = 0;
        unsigned level = 0;
        if (!(words >> when >> std::hex >> lit >> std::dec >> level))
            throw DeviceError(fmt::format("{}: '{}' tells of no lamps", file_.string(), line),
                              "see sim/seen_lamps.h for the form");
        LampSwitch change{TimePoint(Nanoseconds(when)), {}};
        for (std::uint32_t i = 0; i < channels_.size(); ++i)
            if ((lit >> channels_[i] & 1U) != 0) change.burning.push_back({LampId{i}, level / full_level});
        history_.push_back(std::move(change));
    }
}

}  // namespace darkbox::sim
