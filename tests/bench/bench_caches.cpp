// SPDX-License-Identifier: Apache-2.0
// What the cut and the order cache save on a real model and path, in CPU time of one thread, which other work on the
// machine disturbs less than it does the wall clock.
//   bench_caches FILE.gsc PATH.json SORT_FRAMES [WIDTH]
// Selects every frame of the path with and without the cut cache, and sorts SORT_FRAMES consecutive ones from its
// middle with and without the order cache. Stops with an error where a result differs. Images are WIDTH (default 1024)
// pixels wide.
#include "format/error.h"
#include "kernels/common/parallel.h"
#include "kernels/decode/decode.h"
#include "kernels/project/project.h"
#include "kernels/select/cut.h"
#include "kernels/sort/order.h"
#include "player/camera_file.h"
#include "runtime/camera.h"
#include "runtime/scene.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include <time.h>

using namespace gsc;

namespace {

class CpuClock {
public:
    CpuClock() : m_start(now()) {}
    // Milliseconds since the last call.
    double lap()
    {
        const double start = m_start;
        m_start = now();
        return (m_start - start) * 1e3;
    }

private:
    static double now()
    {
        timespec t{};
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
        return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
    }
    double m_start;
};

void benchCut(const ModelView& model, const std::vector<EyeParams>& eyes, const Workers& workers)
{
    CutCache cut;
    SelectScratch scratch, scratch_cut;
    Buffer<VisibleAnchor> visible, visible_cut;
    SelectCounts counts{};
    double plain_ms = 0, cut_ms = 0;
    uint64_t kept = 0, tested = 0, anchors = 0;
    const RasterConstants rules = rasterConstants(*model.params, 0);
    for (const EyeParams& eye : eyes) {
        CpuClock clock;
        const size_t n = selectCpu({&model, &eye, 1, rules, 0}, workers, scratch, visible, counts);
        plain_ms += clock.lap();
        const size_t m = selectCpu({&model, &eye, 1, rules, 0, 0, &cut}, workers, scratch_cut, visible_cut, counts);
        cut_ms += clock.lap();
        if (n != m || std::memcmp(visible.data(), visible_cut.data(), n * sizeof(VisibleAnchor)) != 0)
            throw Error(ErrorCode::Internal, "bench_caches: the cut cache changed the visible set, expected the same");
        kept += counts.groups_kept[0];
        tested += counts.groups_tested[0];
        anchors += n;
    }
    const auto frames = double(eyes.size());
    std::printf("select: %zu frames, %.0f anchors visible, %.4f ms without, %.4f ms with, %.1f %% of %.0f tests kept\n",
                eyes.size(), double(anchors) / frames, plain_ms / frames, cut_ms / frames,
                100 * double(kept) / double(kept + tested), double(kept + tested) / frames);
}

// Splats of one frame, as the frame loop lays them out.
struct Splats {
    Buffer<VisibleAnchor> visible;
    std::vector<uint32_t> depth_bits, counts;
    std::vector<uint16_t> origins;
    uint32_t blocks = 0;
};

void makeSplats(const ModelView& model, const EyeParams& eye, int32_t appearance, const Workers& workers, Splats& out)
{
    SelectScratch scratch;
    SelectCounts counts{};
    const RasterConstants rules = rasterConstants(*model.params, 0);
    const size_t visible = selectCpu({&model, &eye, 1, rules, 0}, workers, scratch, out.visible, counts);
    const uint32_t capacity = kDecodeBlock * model.params->n_offsets;
    out.blocks = uint32_t((visible + kDecodeBlock - 1) / kDecodeBlock);
    out.depth_bits.resize(size_t(out.blocks) * capacity);
    out.origins.resize(out.depth_bits.size());
    out.counts.resize(out.blocks);
    Buffer<float> bias;
    std::vector<DecodeScratch> scratches(size_t(workers.count()));
    std::vector<std::vector<Splat>> splats(scratches.size(), std::vector<Splat>(capacity));
    for (DecodeScratch& s : scratches)
        reserveDecode(model, s);
    const DecodeArgs args = prepareDecode(model, &eye, 1, out.visible.data(), visible, appearance, bias);
    workers.run(out.blocks, 1, [&](size_t begin, size_t end, int worker) {
        for (size_t b = begin; b < end; ++b) {
            const size_t first = b * kDecodeBlock;
            DecodeScratch& s = scratches[size_t(worker)];
            decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, visible - first)), s);
            out.counts[b] = projectBlockCpu({&eye, rules}, s.blocks[0], splats[size_t(worker)].data(),
                                            out.depth_bits.data() + b * capacity, out.origins.data() + b * capacity)
                                .splats;
        }
    });
}

void benchOrder(const ModelView& model, const std::vector<EyeParams>& eyes, size_t frames, int32_t appearance,
                const Workers& workers)
{
    constexpr int kRounds = 5; // each forth and back, so that a round never jumps
    frames = std::min(frames, eyes.size());
    if (frames == 0)
        return;
    const size_t first = (eyes.size() - frames) / 2;
    std::vector<Splats> path(frames);
    for (size_t i = 0; i < frames; ++i)
        makeSplats(model, eyes[first + i], appearance, workers, path[i]);
    SortScratch plain, ordered;
    OrderCache cache;
    double plain_ms = 0, ordered_ms = 0;
    uint64_t splats = 0, moves = 0, sorted = 0;
    for (int round = 0; round < 2 * kRounds; ++round)
        for (size_t i = 0; i < frames; ++i) {
            const Splats& s = path[round % 2 ? frames - 1 - i : i];
            const SortArgs args{&model,
                                s.visible.data(),
                                s.depth_bits.data(),
                                s.origins.data(),
                                s.counts.data(),
                                s.blocks,
                                kDecodeBlock * model.params->n_offsets};
            uint64_t moved = 0;
            // in turns, because the one that comes first finds the depths out of the caches
            CpuClock clock;
            if (round / 2 % 2) {
                sortCpu(args, workers, plain);
                plain_ms += clock.lap();
            }
            const size_t n = sortFromOrder(args, workers, ordered, cache, moved);
            ordered_ms += clock.lap();
            if (round / 2 % 2 == 0) {
                sortCpu(args, workers, plain);
                plain_ms += clock.lap();
            }
            if (std::memcmp(plain.keys[0].data(), ordered.keys[0].data(), n * sizeof(SortKey)) != 0)
                throw Error(ErrorCode::Internal, "bench_caches: the order cache changed the order, expected the same");
            splats += n;
            moves += round + int(i) > 0 ? moved : 0;
            ++sorted;
        }
    std::printf("sort: %zu frames, %.0f splats, %.4f ms without, %.4f ms with, %.1f %% moved\n", frames,
                double(splats) / double(sorted), plain_ms / double(sorted), ordered_ms / double(sorted),
                100 * double(moves) / double(splats));
}

int benchmark(int argc, char** argv)
{
    if (argc != 4 && argc != 5)
        throw Error(ErrorCode::Usage, "bench_caches: expected FILE.gsc PATH.json SORT_FRAMES [WIDTH]");
    const std::unique_ptr<Scene> scene = Scene::open(argv[1]);
    const uint32_t width = argc == 5 ? uint32_t(std::atoi(argv[4])) : 1024;
    std::vector<EyeParams> eyes;
    for (Camera camera : readCameraFile(argv[2])) {
        finishCamera(camera, width, 0, 0);
        eyes.push_back(eyeParams(camera, scene->view().origin));
    }
    const Workers one(1);
    benchCut(scene->view(), eyes, one);
    benchOrder(scene->view(), eyes, size_t(std::atoi(argv[3])), scene->appearanceRows().empty() ? -1 : 0, one);
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    try {
        return benchmark(argc, argv);
    } catch (const Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
