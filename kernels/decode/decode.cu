// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/decode_cuda.h"

#include "kernels/common/depth_cells.cuh"
#include "kernels/common/launch.cuh"
#include "kernels/common/slot_writer.cuh"
#include "kernels/decode/decode_networks.cuh"
#include "kernels/decode/decode_project.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kWarps = kThreads / 32;
constexpr uint32_t kBlocksPerProcessor = 2;
constexpr uint32_t kRows = 16;                          // anchors per warp and step
constexpr uint32_t kStaged = kRows * 4 * kItemsPerLane; // Gaussians per warp and step at most

// Outputs of the networks for the living Gaussians of a warp's step, packed without gaps so that projecting them keeps
// every lane busy: a third to a half of all Gaussians is not alive.
struct Staging {
    float scale[3][kStaged], rotation[4][kStaged], color[3][kStaged]; // before their activations
    float opacity[kStaged];
    uint32_t owner[kStaged]; // row | k << 8
};

struct DecodeShared {
    uint2 fragments[kFragmentTiles * 32];
    float biases[kBiasCount];
    alignas(16) float bank[kBankValues];
    Staging staging[kWarps];
};
static_assert(sizeof(DecodeShared) <= 99 * 1024); // what a block can have on compute capability 8.6, 8.9 and 12.0

// Slots that a warp reserves at once. Few leave smaller gaps, of which every warp has one; many are waited for less often,
// which is worth the gaps of large frames.
constexpr uint32_t kSmallPiece = 64, kLargePiece = 256, kLargeFrame = 4u << 20;

__host__ __device__ __forceinline__ uint32_t slotPiece(uint32_t slot_capacity)
{
    return slot_capacity < kLargeFrame ? kSmallPiece : kLargePiece;
}

// Slots and counts of one eye, gathered by a warp. Two of them with fixed names, not an array: an index that the
// compiler does not know would put them into local memory.
struct EyeTally {
    SlotWriter writer;
    uint32_t alive = 0, dropped = 0, written = 0; // per lane
    unsigned long long pairs = 0;                 // per lane
};

// Hands a warp's counts in and marks the slots it did not use.
__device__ __forceinline__ void finish(const DecodeCudaArgs& args, uint32_t e, const EyeTally& tally, uint32_t positive,
                                       uint32_t lane)
{
    tally.writer.close(lane, args.places + size_t(e) * args.slot_capacity, args.slot_capacity);
    const uint32_t alive = __reduce_add_sync(~0u, tally.alive), dropped = __reduce_add_sync(~0u, tally.dropped),
                   written = __reduce_add_sync(~0u, tally.written);
    const bool any_positive = __any_sync(~0u, (positive >> e & 1u) != 0);
    unsigned long long pairs = tally.pairs;
    for (uint32_t with = 16; with != 0; with /= 2)
        pairs += __shfl_xor_sync(~0u, pairs, with);
    if (lane != 0)
        return;
    if (pairs != 0)
        atomicAdd(&args.counters->pass.pairs[e], pairs);
    if (alive != 0)
        atomicAdd(&args.counters->gaussians[e], alive);
    if (dropped != 0)
        atomicAdd(&args.counters->dropped[e], dropped);
    if (written != 0)
        atomicAdd(&args.counters->splats[e], written);
    if (any_positive)
        atomicOr(&args.counters->any_positive[e], 1u);
}

// Where the Gaussians that this lane keeps go in the staging: slot-major over the warp, so that neighbours share an
// anchor. Returns their number over the warp.
__device__ __forceinline__ uint32_t stagingIndices(uint32_t keep, uint32_t lane, uint32_t (&index)[2 * kItemsPerLane])
{
    uint32_t total = 0;
#pragma unroll
    for (uint32_t slot = 0; slot < 2 * kItemsPerLane; ++slot) {
        const uint32_t mask = __ballot_sync(~0u, (keep >> slot & 1u) != 0);
        index[slot] = total + __popc(mask & ((1u << lane) - 1u));
        total += __popc(mask);
    }
    return total;
}

// Activates, projects and writes those of the `count` staged Gaussians that one eye sees. seen_by, factors: of this
// lane's rows, eyes and opacity factor; needed where what is staged is not this eye's alone.
__device__ __forceinline__ void emitStaged(const DecodeCudaArgs& args, uint32_t e, const Staging& staged,
                                           uint32_t count, const uint32_t (&anchors)[2], const uint32_t (&seen_by)[2],
                                           const float (&factors)[2], uint32_t lane, EyeTally& tally)
{
    const DeviceModel& model = args.model;
    const EyeParams& eye = args.eyes[e];
    const uint32_t K = model.params.n_offsets;
#pragma unroll 1
    for (uint32_t first = 0; first < count; first += 32) {
        const uint32_t i = first + lane, owner = i < count ? staged.owner[i] : 0u;
        const uint32_t row = owner & 255u, k = owner >> 8;
        const uint32_t a0 = __shfl_sync(~0u, anchors[0], (row & 7u) * 4),
                       a1 = __shfl_sync(~0u, anchors[1], (row & 7u) * 4);
        const uint32_t anchor = row < 8 ? a0 : a1;
        float opacity = i < count ? staged.opacity[i] : 0.0f;
        if (args.merged) {
            const uint32_t s0 = __shfl_sync(~0u, seen_by[0], (row & 7u) * 4),
                           s1 = __shfl_sync(~0u, seen_by[1], (row & 7u) * 4);
            const float f0 = __shfl_sync(~0u, factors[0], (row & 7u) * 4),
                        f1 = __shfl_sync(~0u, factors[1], (row & 7u) * 4);
            opacity = ((row < 8 ? s0 : s1) >> e & 1u) != 0 ? opacity * (row < 8 ? f0 : f1) : 0.0f;
        }
        Candidate out;
        bool drawn = false;
        if (opacity >= kOpacityFloor) { // tested already, unless it is both eyes'
            const float4 center = reinterpret_cast<const float4*>(model.placement)[anchor];
            const float2* shape = reinterpret_cast<const float2*>(model.shape + size_t(6) * anchor);
            const float2 s0 = shape[0], s1 = shape[1], s2 = shape[2];
            const uint64_t offset = model.offset[size_t(anchor) * K + k];
            const auto steps = [offset](uint32_t axis) {
                return float(int32_t(uint32_t(offset >> (kOffsetBits * axis)) & ((1u << kOffsetBits) - 1u)) -
                             kOffsetSteps - 1);
            };
            const float position[3] = {fmaf(steps(0), s0.x, center.x), fmaf(steps(1), s0.y, center.y),
                                       fmaf(steps(2), s1.x, center.z)};
            const float sigma[3] = {s1.y * sigmoidFast(staged.scale[0][i]), s2.x * sigmoidFast(staged.scale[1][i]),
                                    s2.y * sigmoidFast(staged.scale[2][i])};
            const float rgb[3] = {sigmoidFast(staged.color[0][i]), sigmoidFast(staged.color[1][i]),
                                  sigmoidFast(staged.color[2][i])};
            float q[4], norm = 0.0f;
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c) {
                q[c] = staged.rotation[c][i];
                norm = fmaf(q[c], q[c], norm);
            }
            const float inverse = rsqrtf(fmaxf(norm, 1e-24f));
#pragma unroll
            for (uint32_t c = 0; c < 4; ++c)
                q[c] *= inverse;
            bool finite = offset != kNoOffset;
            const bool here =
                args.pass.count == 1 ||
                passOf(args.pass, args.grid, viewPoint<float>(eye, {position[0], position[1], position[2]}).z) ==
                    args.pass.index;
            if (here) {
                ++tally.alive;
                finite = finite && isfinite(rgb[0] + rgb[1] + rgb[2]); // geometry is for projectFast to see
                drawn = finite && projectFast(args, eye, position, sigma, q, opacity, rgb, model.source[anchor] * K + k,
                                              out, finite);
                tally.dropped += finite ? 0u : 1u;
            }
        }
        const uint32_t slot =
            tally.writer.reserve(drawn, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[e]);
        if (drawn && slot < args.slot_capacity) {
            ++tally.written;
            tally.pairs += binCount(out.place);
            const size_t at = size_t(e) * args.slot_capacity + slot;
            reinterpret_cast<uint4*>(args.splats + at)[0] = out.words[0];
            reinterpret_cast<uint4*>(args.splats + at)[1] = out.words[1];
            args.places[at] = out.place;
        } else {
            if (drawn)
                atomicOr(&args.counters->overflow, kSlotOverflow);
            out.place.box = kNoBins;
        }
        uint32_t* cells = args.cells + size_t(e) * args.grid.cells();
        forCellsOfWarp(
            args.grid, args.pass.slab_of, out.place, 0, [&](uint32_t cell) { return atomicAdd(cells + cell, 1u); },
            [](uint32_t, uint32_t, uint32_t) {});
    }
}

// kBank: the model has a feature bank, which makes the features depend on the eye.
template <bool kBank>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor)
    decodeKernel(const __grid_constant__ DecodeCudaArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    DecodeShared& shared = *reinterpret_cast<DecodeShared*>(memory);
    for (uint32_t i = threadIdx.x; i < kFragmentTiles * 32; i += kThreads)
        shared.fragments[i] = static_cast<const uint2*>(args.fragments)[i];
    for (uint32_t i = threadIdx.x; i < kBiasCount; i += kThreads)
        shared.biases[i] = args.biases[i];
    if constexpr (kBank)
        for (uint32_t i = threadIdx.x; i < kBankValues; i += kThreads)
            shared.bank[i] = args.bank[i];
    __syncthreads();

    const DeviceModel& model = args.model;
    const uint32_t K = model.params.n_offsets;
    const uint32_t lane = threadIdx.x & 31u, t = lane & 3u, g = lane >> 2;
    const uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) >> 5, warps = gridDim.x * kThreads / 32;
    const uint32_t count = min(args.counters->anchors_listed, args.visible_capacity);
    const uint2* fragments = shared.fragments;
    const float* biases = shared.biases;
    Staging& staged = shared.staging[threadIdx.x >> 5];
    EyeTally left, right;
    uint32_t positive = 0; // bit per eye

    for (uint32_t first = warp * kRows; first < count; first += warps * kRows) {
        uint32_t anchors[2], seen_by[2];
        float positions[2][3];
        uint32_t feature[2][4]; // per k tile
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const uint32_t index = first + g + 8 * r;
            const uint32_t entry = index < count ? args.visible[index] : 0u;
            anchors[r] = entry & ((1u << kAnchorBits) - 1u);
            seen_by[r] = entry >> kAnchorBits; // 0: no anchor
            const float4 p = reinterpret_cast<const float4*>(model.placement)[anchors[r]];
            positions[r][0] = p.x;
            positions[r][1] = p.y;
            positions[r][2] = p.z;
            if (args.pass.count > 1) {
                const float* steps = model.shape + size_t(6) * anchors[r];
                const float reach = float(kOffsetSteps) * norm3df(steps[0], steps[1], steps[2]);
                for (uint32_t e = 0; e < args.eye_count; ++e)
                    if (!mayBeIn(args.pass, args.grid, args.eyes[e], {p.x, p.y, p.z}, reach))
                        seen_by[r] &= ~(1u << e);
            }
        }
        const uint32_t seen = __reduce_or_sync(~0u, seen_by[0] | seen_by[1]);
        if (seen == 0)
            continue; // a group lies close together: often all of its anchors are in other passes
#pragma unroll
        for (uint32_t r = 0; r < 2; ++r) {
            const uint4 f = reinterpret_cast<const uint4*>(model.feature)[size_t(anchors[r]) * 4 + t];
            feature[0][r] = f.x;
            feature[0][2 + r] = f.y;
            feature[1][r] = f.z;
            feature[1][2 + r] = f.w;
        }
        float levels[2] = {0.0f, 0.0f};
        if (args.takes_level)
            for (uint32_t l = 0; l < model.params.level_count; ++l)
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
                    if (anchors[r] >= model.level_first[l])
                        levels[r] = float(model.levels[l].level);

        const uint32_t decodes = args.merged ? 1 : args.eye_count;
#pragma unroll 1
        for (uint32_t e = 0; e < decodes; ++e) {
            if (!args.merged && (seen >> e & 1u) == 0)
                continue;
            const float* const center = args.merged ? args.look_from : args.eyes[e].center;
            uint32_t view[4], banked[2][4];
#pragma unroll
            for (uint32_t r = 0; r < 2; ++r) {
                float u[3];
                for (int i = 0; i < 3; ++i)
                    u[i] = positions[r][i] - center[i];
                const float distance = sqrtf(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
                const float inverse = __fdividef(1.0f, distance);
                for (int i = 0; i < 3; ++i)
                    u[i] *= inverse;
                viewOperand(t, u, args.takes_distance ? distance : 0.0f, levels[r], view[r], view[2 + r]);
                if constexpr (kBank) {
                    float weights[3];
                    bankWeights(shared.bank, t, u, distance, levels[r], weights);
                    bankedFeatures(feature, r, weights, lane, banked);
                }
            }
            const uint32_t(&inputs)[2][4] = kBank ? banked : feature;
            uint32_t hidden[6][4]; // A operands of the second layers, two k tiles per head
#pragma unroll
            for (uint32_t nt = 0; nt < kFirstTiles; ++nt) {
                const float2 bias = *reinterpret_cast<const float2*>(biases + nt * 8 + 2 * t);
                float d[4] = {bias.x, bias.y, bias.x, bias.y};
                mmaM16N8K16(d, inputs[0], fragments[nt * 32 + lane]);
                mmaM16N8K16(d, inputs[1], fragments[(kFirstTiles + nt) * 32 + lane]);
                mmaM16N8K16(d, view, fragments[(2 * kFirstTiles + nt) * 32 + lane]);
                hidden[nt / 2][(nt & 1u) * 2] = halvesRelu(d[0], d[1]);
                hidden[nt / 2][(nt & 1u) * 2 + 1] = halvesRelu(d[2], d[3]);
            }
            const uint2* second = fragments + 3 * kFirstTiles * 32;
            const float* bias2 = biases + 8 * kFirstTiles;
            uint32_t keep = 0; // bit 3 r + item
            uint32_t at[2 * kItemsPerLane];
            uint32_t alive;
            {
                float opacity[kOpacityTiles][4];
                secondLayer<kOpacityTiles>(second, bias2, lane, hidden, opacity);
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item) {
                        float o = tanhFast(value(opacity, item, r));
                        if (args.fraction != nullptr && !args.merged)
                            o *= args.fraction[2 * min(first + g + 8 * r, count - 1) + e];
                        const uint32_t eyes = args.merged ? seen_by[r] : seen_by[r] & 1u << e;
                        const bool present = eyes != 0 && t + 4 * item < K;
                        if (present && o > 0.0f)
                            positive |= eyes;
                        if (present && o >= kOpacityFloor)
                            keep |= 1u << (kItemsPerLane * r + item);
                        opacity[item >> 1][(item & 1u) + 2 * r] = o;
                    }
                alive = stagingIndices(keep, lane, at);
                if (alive == 0)
                    continue;
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item)
                        if (keep >> (kItemsPerLane * r + item) & 1u) {
                            const uint32_t i = at[kItemsPerLane * r + item];
                            staged.opacity[i] = value(opacity, item, r);
                            staged.owner[i] = (g + 8 * r) | (t + 4 * item) << 8;
                        }
            }
            {
                float covariance[kCovarianceTiles][4];
                secondLayer<kCovarianceTiles>(second + 2 * kOpacityTiles * 32, bias2 + 8 * kOpacityTiles, lane,
                                              hidden + 2, covariance);
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item)
                        if (keep >> (kItemsPerLane * r + item) & 1u) {
                            const uint32_t i = at[kItemsPerLane * r + item];
#pragma unroll
                            for (uint32_t c = 0; c < 3; ++c)
                                staged.scale[c][i] = value(covariance, 7 * item + c, r);
#pragma unroll
                            for (uint32_t c = 0; c < 4; ++c)
                                staged.rotation[c][i] = value(covariance, 7 * item + 3 + c, r);
                        }
            }
            {
                float color[kColorTiles][4];
                secondLayer<kColorTiles>(second + 2 * (kOpacityTiles + kCovarianceTiles) * 32,
                                         bias2 + 8 * (kOpacityTiles + kCovarianceTiles), lane, hidden + 4, color);
#pragma unroll
                for (uint32_t r = 0; r < 2; ++r)
#pragma unroll
                    for (uint32_t item = 0; item < kItemsPerLane; ++item)
                        if (keep >> (kItemsPerLane * r + item) & 1u)
#pragma unroll
                            for (uint32_t c = 0; c < 3; ++c)
                                staged.color[c][at[kItemsPerLane * r + item]] = value(color, 3 * item + c, r);
            }
            __syncwarp();
#pragma unroll 1
            for (uint32_t v = e; v < (args.merged ? args.eye_count : e + 1); ++v) {
                float factors[2] = {1.0f, 1.0f};
                if (args.merged && args.fraction != nullptr)
                    for (uint32_t r = 0; r < 2; ++r)
                        factors[r] = args.fraction[2 * min(first + g + 8 * r, count - 1) + v];
                EyeTally tally = v == 0 ? left : right;
                emitStaged(args, v, staged, alive, anchors, seen_by, factors, lane, tally);
                if (v == 0)
                    left = tally;
                else
                    right = tally;
            }
            __syncwarp();
        }
    }
    finish(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish(args, 1, right, positive, lane);
}

} // namespace

void prepareDecodeCuda()
{
    raiseSharedLimit(decodeKernel<false>, sizeof(DecodeShared));
    raiseSharedLimit(decodeKernel<true>, sizeof(DecodeShared));
}

uint32_t decodeFastGaps(uint32_t processors, uint32_t slot_capacity)
{
    return processors * kBlocksPerProcessor * kWarps * slotPiece(slot_capacity);
}

void decodeFastCuda(const DecodeCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(args.bank != nullptr ? decodeKernel<true> : decodeKernel<false>, processors * kBlocksPerProcessor,
               kThreads, sizeof(DecodeShared), stream, args);
}

} // namespace gsc
