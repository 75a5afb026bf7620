#include "sim/bridge/lamp_lines.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <numeric>

#include "acquisition/device/device_error.h"

namespace darkbox::sim {

LampLines::LampLines(const std::filesystem::path& chip, std::size_t lamps, const WiringFault& fault) {
    std::vector<std::size_t> line(lamps);
    std::iota(line.begin(), line.end(), std::size_t{0});
    for (const auto& [a, b] : fault.swapped) std::swap(line.at(a), line.at(b));
    for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
        line_of_lamp_.emplace_back();
        if (std::find(fault.cut.begin(), fault.cut.end(), lamp) != fault.cut.end()) continue;
        const auto file = chip / fmt::format("sim_gpio{}", line[lamp]) / "value";
        line_of_lamp_.back().reset(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
        if (!line_of_lamp_.back()) throw_errno("open", file.string(), errno);
    }
}

std::vector<double> LampLines::burning() const {
    std::vector<double> burning;
    for (const UniqueFd& line : line_of_lamp_) {
        char level = '0';
        burning.push_back(line && ::pread(line.get(), &level, 1, 0) == 1 && level == '1' ? 1.0 : 0.0);
    }
    return burning;
}

}  // namespace darkbox::sim
