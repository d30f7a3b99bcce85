// SPDX-License-Identifier: Apache-2.0
// Draws strips from their entries: projects the kept Gaussians to splats, as decode does behind its networks.
#include "kernels/cuda/launch.cuh"
#include "kernels/reuse/kept_entry.cuh"

#include <type_traits>

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
// blocks per multiprocessor, which leaves 80 registers to a thread on sm_90
constexpr uint32_t kBlocksPerProcessor = 3;

// Used with shared bins, where a warp draws a strip for one eye after the other: for each Gaussian of the strip the
// splat slot to which the first eye wrote it and that the second eye has not drawn yet; kNoSlot if there is none.
struct Written {
    uint32_t slot[kStaged];

    __device__ __forceinline__ uint32_t& of(uint32_t owner) { return slot[(owner & 255u) + (owner >> 8) * kRows]; }
};

// Cache slot of the entry from which an eye draws a strip; kNoEntry if the eye does not draw it from an entry.
__device__ __forceinline__ uint32_t drawnSlot(const KeepCudaArgs& args, const ListedStrip& strip, uint32_t eye)
{
    return lanesOfEye(strip.lanes, eye) != 0 ? args.tables.keptSlot(strip.strip, args.merged ? 0 : eye) : kNoEntry;
}

// Finishes the Gaussians of a strip that the first eye wrote and the second eye does not draw.
template <bool kCompact>
__device__ __forceinline__ void finishFirst(const KeepCudaArgs& args, Written& written, uint32_t lane, EyeTally& tally)
{
    const uint32_t none[2] = {0, 0};
    const float factors[2] = {0, 0};
    __syncwarp();
#pragma unroll 1
    for (uint32_t at = 0; at < args.model.params.n_offsets * kRows; at += 32) {
        StagedLane staged{};
        staged.its_slot = at + lane < kStaged ? written.slot[at + lane] : kNoSlot;
        if (!__any_sync(~0u, staged.its_slot != kNoSlot))
            continue;
        emitStaged<kCompact, true, false>(args, 1, staged, 32, {false, true}, none, factors, lane, tally);
        if (at + lane < kStaged)
            written.slot[at + lane] = kNoSlot;
    }
}

// kCompact: the model is compact. kShared, kThins: as in DecodeFrame.
template <bool kCompact, bool kShared, bool kThins>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) drawKernel(const __grid_constant__ KeepCudaArgs args)
{
    const uint32_t lane = threadIdx.x & 31u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) >> 5, warps = gridDim.x * kThreads / 32;
    const uint32_t strips = args.tables.counters->strips, room = args.tables.room;
    // in shared memory, since in registers two tallies would leave no room for a third block
    __shared__ __align__(8) unsigned char memory[kMaxEyes * kThreads * sizeof(EyeTally)];
    EyeTally* const tallies = reinterpret_cast<EyeTally*>(memory) + threadIdx.x;
    tallies[0] = tallies[kThreads] = EyeTally();
    __shared__ Written writtens[kShared ? kThreads / 32 : 1];
    Written& written = writtens[kShared ? threadIdx.x >> 5 : 0];
    if constexpr (kShared)
        for (uint32_t i = lane; i < kStaged; i += 32)
            written.slot[i] = kNoSlot;
    uint32_t positive = 0; // a bit for each eye that sees an opacity above zero
    for (uint32_t i = warp; i < strips; i += warps) {
        const ListedStrip strip = args.tables.listed[i];
        const uint32_t slots[kMaxEyes] = {drawnSlot(args, strip, 0), drawnSlot(args, strip, 1)};
        const uint32_t seen_by[2] = {eyesOfRow(strip.lanes, g), eyesOfRow(strip.lanes, g + 8)};
        const bool both = slots[0] != kNoEntry && slots[1] != kNoEntry;
        if (kShared)
            __syncwarp(); // waits before `written` is used again
#pragma unroll 1
        for (uint32_t v = 0; v < args.eye_count; ++v) {
            const uint32_t slot = v == 0 ? slots[0] : slots[1];
            if (slot == kNoEntry)
                continue;
            const KeptWord* const words = wordsOf(args.tables, slot);
            const KeptEntry& entry = args.tables.entries[slot];
            const uint32_t count = entry.alive;
            if ((entry.positive & strip.lanes >> (16 * v)) != 0)
                positive |= 1u << v;
            float factors[2];
            keptFactors(args.fraction, i, v, lane, factors);
            const Turns turns = {!both || v == 0, !both || v == 1};
            EyeTally tally = tallies[v * kThreads];
            if (kShared && v != 0) // with shared bins both eyes take splat slots from the writer of the first eye
                tally.writer = tallies[0].writer;
#pragma unroll 1
            for (uint32_t first = 0; first < count; first += 32) {
                // within the entry, since room is a multiple of 32
                StagedLane staged = loadKept(words, room, first + lane);
                staged.first = strip.first;
                const bool some = first + lane < count;
                if (kShared && !turns.first && some) {
                    staged.its_slot = written.of(staged.its_owner);
                    written.of(staged.its_owner) = kNoSlot;
                }
                emitStaged<kCompact, kShared, kThins>(args, v, staged, min(count - first, 32u), turns, seen_by, factors,
                                                      lane, tally);
                if (kShared && !turns.last && some)
                    written.of(staged.its_owner) = staged.its_slot;
            }
            if constexpr (kShared) {
                if (!turns.last)
                    __syncwarp();
                else if (!turns.first && slots[0] != slots[1])
                    finishFirst<kCompact>(args, written, lane, tally);
                if (v != 0)
                    tallies[0].writer = tally.writer;
            }
            tallies[v * kThreads] = tally;
        }
    }
    for (uint32_t e = 0; e < args.eye_count; ++e)
        finish<kShared>(args, e, tallies[e * kThreads], positive, lane);
}

} // namespace

uint32_t drawKeptGaps(uint32_t processors, uint32_t slot_capacity)
{
    return processors * kBlocksPerProcessor * (kThreads / 32) * slotPiece(slot_capacity);
}

void drawKeptCuda(const KeepCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const auto of_layout = [&args](auto compact) {
        constexpr bool kCompact = decltype(compact)::value;
        return args.thins ? (args.shared_bins ? drawKernel<kCompact, true, true> : drawKernel<kCompact, false, true>)
                          : (args.shared_bins ? drawKernel<kCompact, true, false> : drawKernel<kCompact, false, false>);
    };
    const auto kernel =
        args.model.compact_shape != nullptr ? of_layout(std::true_type()) : of_layout(std::false_type());
    launchCuda(kernel, processors * kBlocksPerProcessor, kThreads, 0, stream, args);
}

} // namespace gsc
