#include <benchmark/benchmark.h>

#include <fstream>
#include <string>

#include "processing/transfer/transfer.h"
#include "tests/processing/transfer/exemplars.h"

namespace darkbox {
namespace {

/// Forgets the process's peak of memory so far.
void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

double peak_mib() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (double kib = 0; word == "VmHWM:" && status >> kib) return kib / 1024;
    return 0;
}

/// Stones on a sphere moved onto waves of the same size; on `threads` threads. `peak_MiB` is the
/// whole process's, with what earlier benchmarks left in it: run one at a time for the transfer's own.
void transfer(benchmark::State& state, TransferMethod method) {
    const int side = static_cast<int>(state.range(0));
    const TransferSource source = test::stony(test::sphere_normals(side), 200, 7);
    const NormalMap target = test::wavy_normals({side, side});
    TransferOptions options = test::by(method);
    options.kappa = static_cast<double>(state.range(2));
    TransferResult result;
    reset_peak();
    for (auto _ : state) {
        result = test::transferred_on(static_cast<int>(state.range(1)), source, target, options);
        state.SetIterationTime(result.seconds);
    }
    state.counters["peak_MiB"] = peak_mib();
    state.counters["us_per_pixel"] = result.seconds * 1e6 / side / side;
    state.counters["coherence"] = result.coherence;
    state.counters["patch_energy"] = result.patch_energy.value();
    state.counters["histogram_distance"] = result.histogram_distance.value();
}

void growth(benchmark::internal::Benchmark* bench) {
    bench->ArgNames({"side", "threads", "kappa"})->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(1);
    bench->Args({256, 2, 0})->Args({512, 1, 0})->Args({512, 2, 0})->Args({1024, 2, 0})->Args({2048, 2, 0});
}

BENCHMARK_CAPTURE(transfer, preview, TransferMethod::preview)->Apply(growth);
BENCHMARK_CAPTURE(transfer, patchmatch, TransferMethod::patchmatch)->Apply(growth);
BENCHMARK_CAPTURE(transfer, analogies, TransferMethod::analogies)
    ->ArgNames({"side", "threads", "kappa"})
    ->Args({256, 1, 0})
    ->Args({256, 2, 0})
    ->Args({256, 2, 2})
    ->Args({512, 2, 2})
    ->Unit(benchmark::kMillisecond)
    ->UseManualTime()
    ->Iterations(1);

}  // namespace
}  // namespace darkbox
