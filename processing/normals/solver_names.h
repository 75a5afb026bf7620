#pragma once

#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "acquisition/frame/error.h"
#include "processing/normals/photometric_stereo.h"

namespace darkbox {

/// Each solver as the command line and results/summary.json name it.
inline constexpr std::array<std::pair<Solver, std::string_view>, 2> solver_names{
    {{Solver::lsq, "lsq"}, {Solver::robust, "robust"}}};

constexpr std::string_view name(Solver solver) {
    for (const auto& [known, text] : solver_names)
        if (known == solver) return text;
    return "";
}

/// Throws InputError for a name that is none.
inline Solver solver_named(std::string_view text) {
    for (const auto& [solver, known] : solver_names)
        if (known == text) return solver;
    throw InputError(fmt::format("there is no solver '{}'", text), "run 'darkbox normals' again");
}

}  // namespace darkbox
