#include <benchmark/benchmark.h>

#include "processing/transfer/transfer.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

/// Stones on a sphere moved onto waves of the same size; on `threads` threads.
void transfer(benchmark::State& state) {
    const int side = static_cast<int>(state.range(0));
    const TransferSource source = test::stony(test::sphere_normals(side), 200, 7);
    const NormalMap target = test::wavy_normals({side, side});
    TransferOptions options;
    options.kappa = static_cast<double>(state.range(2));
    TransferResult result;
    for (auto _ : state) result = test::transferred_on(static_cast<int>(state.range(1)), source, target, options);
    state.counters["coherence"] = result.coherence;
    state.counters["patch_energy"] = result.patch_energy;
}

BENCHMARK(transfer)
    ->ArgNames({"side", "threads", "kappa"})
    ->Args({256, 1, 0})
    ->Args({256, 2, 0})
    ->Args({256, 2, 2})
    ->Args({512, 2, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1);

}  // namespace
}  // namespace darkbox
