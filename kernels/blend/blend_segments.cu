// SPDX-License-Identifier: Apache-2.0
// Lists that are cut into segments (bin): blended beside the others.
#include "kernels/blend/blend_bin.cuh"

namespace gsc {

namespace {

// A segment of a long list, blended by a block. First every segment is blended for itself, as if its pixels were empty
// before it. What it lets through, times what those before it do, tells whose pixels finish in it: those are blended
// again, with what reaches them. Who is the last to be done adds up the segments from near to far, so that the sum does
// not depend on who was.
template <typename Rules, typename T>
struct SegmentWork {
    const BlendCudaArgs& args;
    const Team& team;
    const Batches<typename Rules::Lit>& batches;
    const ListSegment* segment;

    static constexpr uint32_t kPixels = kBinWidth * T::kBinRows * T::kHeight;

    // Of a segment of the list and a pixel of the bin; plane 0 to 2: colour, 3: transmittance, negative where it
    // finished by itself, 4: that of a pixel blended again.
    [[nodiscard]] __device__ __forceinline__ float* plane(uint32_t number, uint32_t which) const
    {
        return args.partial + (size_t(segment->first + number) * kSegmentPlanes + which) * kPixels;
    }

    // What reaches segment `number`, and whether the pixel finishes in it. Not positive: it did before.
    struct Reaching {
        float transmittance;
        bool finishes;
    };
    [[nodiscard]] __device__ __forceinline__ Reaching reaching(float begun, uint32_t number, uint32_t pixel) const
    {
        float light = begun;
        for (uint32_t s = 0;; ++s) {
            const float through = loadFresh(plane(s, 3) + pixel);
            const bool finishes = !(through > 0.0f && light * through >= args.rules.stop);
            if (s == number)
                return {light, light > 0.0f && finishes};
            light = finishes ? -1.0f : light * through;
        }
    }

    __device__ __forceinline__ void blend(const Area& area, bool again, uint32_t row0, uint32_t column0,
                                          uint32_t& evaluations) const
    {
        const uint32_t number = segment->number;
        T tile;
        uint32_t open = 0;
        forPixels<T>(row0, column0, [&](uint32_t row, uint32_t column, uint32_t x, uint32_t y) {
            const float begun = begunPixel<false>(args, area.eye, area.bin_x + x, area.bin_y + y).transmittance;
            float transmittance = begun > 0.0f ? 1.0f : -1.0f;
            if (again && begun > 0.0f) {
                const Reaching at = reaching(begun, number, y * kBinWidth + x);
                // what all of the light reaches is right already
                transmittance = at.finishes && at.transmittance != 1.0f ? at.transmittance : -1.0f;
            }
            tile.transmittance[row][column] = transmittance;
            for (int i = 0; i < 3; ++i)
                tile.color[row][column][i] = 0.0f;
            open |= __any_sync(~0u, transmittance > 0.0f) ? 1u << (row * T::kColumns + column) : 0u;
        });
        if (!team.any(open != 0) && again)
            return;
        const uint32_t begin = area.begin + number * segment->length;
        blendKeys<Rules>(args, team, batches, area, begin, min(begin + segment->length, area.end), row0, column0, open,
                         tile, evaluations);
        forPixels<T>(row0, column0, [&](uint32_t row, uint32_t column, uint32_t x, uint32_t y) {
            const uint32_t pixel = y * kBinWidth + x;
            const float transmittance = tile.transmittance[row][column];
            if (again && transmittance == -1.0f) // was not blended
                return;
            for (uint32_t i = 0; i < 3; ++i)
                plane(number, i)[pixel] = tile.color[row][column][i];
            plane(number, again ? 4 : 3)[pixel] = again ? fabsf(transmittance) : transmittance;
        });
    }

    __device__ __forceinline__ void addUp(const Area& area, uint32_t row0, uint32_t column0) const
    {
        forPixels<T>(row0, column0, [&](uint32_t, uint32_t, uint32_t x, uint32_t y) {
            const uint32_t pixel = y * kBinWidth + x;
            Begun sum = begunPixel<false>(args, area.eye, area.bin_x + x, area.bin_y + y);
            float& light = sum.transmittance;
            for (uint32_t s = 0; s < segment->count && light > 0.0f; ++s) {
                const float through = loadFresh(plane(s, 3) + pixel);
                const bool finishes = !(through > 0.0f && light * through >= args.rules.stop);
                const bool again = finishes && light != 1.0f; // its colour has met the light
                for (uint32_t i = 0; i < 3; ++i)
                    sum.color[i] = fmaf(again ? 1.0f : light, loadFresh(plane(s, i) + pixel), sum.color[i]);
                light = again ? -loadFresh(plane(s, 4) + pixel) : light * through;
            }
            endPixel<false>(args, area.eye, area.bin_x + x, area.bin_y + y, light, sum.color);
        });
    }

    // All threads of the block call it. last: a word of shared memory.
    __device__ __forceinline__ void run(bool again, uint32_t row0, uint32_t column0, uint32_t* last,
                                        uint32_t& evaluations) const
    {
        Area area{};
        if (segment->count == 0 || !areaOf<T>(args, {segment->entry, segment->eye}, area))
            return;
        ListSegment& list = args.segments[segment->first];
        if (again) {
            // all of the list are taken, by blocks that wait for nothing
            if (team.thread == 0)
                while (loadFresh(&list.blended) != list.count) {
                }
            fenceDevice();
            team.sync();
        }
        blend(area, again, row0, column0, evaluations);
        fenceDevice();
        team.sync();
        if (team.thread == 0)
            *last = atomicAdd(again ? &list.settled : &list.blended, 1u) + 1;
        team.sync();
        if (!again || *last != list.count)
            return;
        fenceDevice();
        addUp(area, row0, column0);
    }
};

// kRows: of a warp that shares its bin with three others.
template <uint32_t kRows>
__global__ void __launch_bounds__(kBlendThreads, kBlendBlocks) segmentKernel(const __grid_constant__ BlendCudaArgs args)
{
    launchDependents(); // the other bins take the multiprocessors that this leaves
    const uint32_t segments = min(args.counters->pass.segments, args.segment_capacity);
    if (segments == 0 || willRepeat(*args.counters))
        return;
    GSC_DYNAMIC_SHARED(memory);
    using Rules = FastRules;
    using Shared = BlendShared<Rules, kRows>;
    Shared& shared = *reinterpret_cast<Shared*>(memory);
    const uint32_t warp = threadIdx.x >> 5;
    const Team everyone{0, kBlendThreads, threadIdx.x};
    const Batches<typename Rules::Lit> all{
        {shared.batches[0], shared.batches[1]}, {shared.touched[0], shared.touched[1]}, shared.lists[warp]};
    if (threadIdx.x < 2)
        shared.batches[threadIdx.x][kBlendThreads] = Rules::nothing();
    uint32_t evaluations[kMaxEyes] = {};
    while (true) {
        if (threadIdx.x == 0)
            shared.next[0] = atomicAdd(&args.counters->pass.next_segment, 1u);
        everyone.sync();
        const uint32_t i = shared.next[0];
        everyone.sync();
        if (i >= 2 * segments)
            break;
        const bool again = i >= segments;
        const SegmentWork<Rules, HotTile<kRows>> work{args, everyone, all, args.segments + (again ? i - segments : i)};
        uint32_t seen = 0;
        work.run(again, warp / 8 * (kRows / 2), warp % 8, shared.next + 1, seen);
        evaluations[0] += work.segment->eye == 0 ? seen : 0u;
        evaluations[1] += work.segment->eye == 0 ? 0u : seen;
    }
    countEvaluations(args, evaluations);
}

template <uint32_t kRows>
void launchSegments(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    // note: a block of each multiprocessor, so that the other bins start at once
    launchCuda(segmentKernel<kRows>, processors, kBlendThreads, sizeof(BlendShared<FastRules, kRows>), stream, args);
}

} // namespace

void blendSegmentsCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    if (args.grid.height == 16)
        launchSegments<2>(args, processors, stream);
    else
        launchSegments<4>(args, processors, stream);
}

} // namespace gsc
