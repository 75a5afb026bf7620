#include <fmt/format.h>

#include <cstdlib>
#include <thread>

#include "tests/rig/capture/study/sync_study.h"

/// sync_study [LIGHTS [SEED]]: the synchronisation study, as a table on stdout.
int main(int argc, char** argv) {
    const std::size_t lights = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 300'000;
    const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
    const auto rows =
        darkbox::test::run_study(lights, static_cast<int>(std::max(1u, std::thread::hardware_concurrency())), seed);
    fmt::print("{}", darkbox::test::table(rows));
    for (const auto& row : rows)
        for (const auto& [what, count] : row.tally.errors)
            fmt::print(stderr, "{} {}: {} sessions: {}\n", name(row.mode), name(row.lie), count, what);
    std::size_t wrong = 0;
    for (const auto& row : rows) wrong += row.tally.wrong;
    return wrong == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
