// SPDX-License-Identifier: Apache-2.0
// Scalar reference against the fast path on blend and decode, one thread, and two threads against one, in one run.
// Prints the ratios after Google Benchmark's table: of processor time on one thread, of wall clock between one thread
// and two. Two threads cannot gain on a busy machine.
//   bench_kernels [benchmark options]
#include "tests/bench/bench_scene.h"
#include "tests/kernels/synthetic_model.h"

#include <benchmark/benchmark.h>

#include <cstdio>
#include <map>
#include <string>

using namespace gsc;
using namespace gsc::bench;

namespace {

// A room full of anchors seen from inside: about as many evaluations per pixel as the trained models have.
test::SyntheticOptions benchOptions()
{
    test::SyntheticOptions options;
    options.anchors = 60000;
    options.log_scale = -3.6f;
    options.seed = 17;
    return options;
}

BenchScene& scene()
{
    static const test::SyntheticModel model(benchOptions());
    static const float position[3] = {0, 0.3f, -3.5f}, target[3] = {0, 0, 4};
    static BenchScene instance(model.view(), test::lookAt(position, target, 0.9f, 1280, 720), -1);
    return instance;
}

void blendFast(benchmark::State& state)
{
    const Workers workers(int(state.range(0)));
    uint64_t evaluations = 0;
    for (auto _ : state)
        evaluations = scene().blendFast(workers);
    state.counters["evaluations"] = double(evaluations);
    state.counters["evaluations/s"] =
        benchmark::Counter(double(evaluations), benchmark::Counter::kIsIterationInvariantRate);
}

void blendReferenceSameLists(benchmark::State& state)
{
    for (auto _ : state)
        benchmark::DoNotOptimize(scene().blendReferenceSameLists());
}

void blendReferenceFullLists(benchmark::State& state)
{
    for (auto _ : state)
        benchmark::DoNotOptimize(scene().blendReferenceFullLists());
}

void decodeFast(benchmark::State& state)
{
    const Workers workers(int(state.range(0)));
    for (auto _ : state)
        benchmark::DoNotOptimize(scene().decodeFast(workers));
    state.counters["anchors/s"] =
        benchmark::Counter(double(scene().visible()), benchmark::Counter::kIsIterationInvariantRate);
}

void decodeReference(benchmark::State& state)
{
    for (auto _ : state)
        benchmark::DoNotOptimize(scene().decodeReference());
}

BENCHMARK(blendFast)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(blendReferenceSameLists)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(blendReferenceFullLists)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(decodeFast)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(decodeReference)->Unit(benchmark::kMillisecond)->UseRealTime();

// Keeps the best repetition of every benchmark: a disturbed one says nothing about the code.
class BestReporter : public benchmark::ConsoleReporter {
public:
    void ReportRuns(const std::vector<Run>& runs) override
    {
        for (const Run& run : runs)
            if (run.run_type == Run::RT_Iteration && !run.error_occurred) {
                const std::string name = run.run_name.function_name + "/" + run.run_name.args;
                Best& best = m_best.emplace(name, Best{}).first->second;
                best.wall = std::min(best.wall, run.GetAdjustedRealTime());
                best.cpu = std::min(best.cpu, run.GetAdjustedCPUTime());
            }
        ConsoleReporter::ReportRuns(runs);
    }

    void ratio(const char* what, const char* slow, const char* fast, bool one_thread, double bar) const
    {
        const auto a = m_best.find(slow), b = m_best.find(fast);
        if (a == m_best.end() || b == m_best.end())
            return;
        const double slow_ms = one_thread ? a->second.cpu : a->second.wall;
        const double fast_ms = one_thread ? b->second.cpu : b->second.wall;
        std::printf("%-56s %8.2f ms / %7.2f ms = %6.2f (bar %.1f)\n", what, slow_ms, fast_ms, slow_ms / fast_ms, bar);
    }

private:
    struct Best {
        double wall = 1e300, cpu = 1e300; // milliseconds
    };
    std::map<std::string, Best> m_best;
};

} // namespace

int main(int argc, char** argv)
{
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv))
        return 1;
    BenchScene& view = scene();
    view.blendFast(Workers(1));
    view.blendReferenceFullLists();
    std::printf("%zu visible anchors, %zu Gaussians, %llu pairs, worst difference to the reference image %.2g\n",
                view.visible(), view.gaussians(), static_cast<unsigned long long>(view.pairs()),
                double(view.worstDifference()));
    if (view.worstDifference() > 0.05f) {
        std::fprintf(stderr, "bench_kernels: the fast image differs from the reference, expected the same picture\n");
        return 8;
    }
    BestReporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
    reporter.ratio("blend: scalar reference, same lists / fast, one thread", "blendReferenceSameLists/", "blendFast/1",
                   true, 15);
    reporter.ratio("blend: scalar reference, full lists / fast, one thread", "blendReferenceFullLists/", "blendFast/1",
                   true, 15);
    reporter.ratio("decode: scalar reference / fast, one thread", "decodeReference/", "decodeFast/1", true, 15);
    reporter.ratio("blend: one thread / two", "blendFast/1", "blendFast/2", false, 1.8);
    reporter.ratio("decode: one thread / two", "decodeFast/1", "decodeFast/2", false, 1.8);
    return 0;
}
