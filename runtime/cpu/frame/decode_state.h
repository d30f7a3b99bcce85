// SPDX-License-Identifier: Apache-2.0
// Outputs, scratch memory and counters that all ways to decode a frame on a CPU use: plain, with reuse, with coarse
// copies.
#pragma once

#include "kernels/simd/buffer.h"
#include "kernels/reuse/packed_strip.h"
#include "kernels/project/project.h"

#include <vector>

namespace gsc {

// One eye's splats, by blocks of anchors: block b owns the slots b * capacity to (b + 1) * capacity - 1.
struct SplatStore {
    Buffer<Splat> splats;
    Buffer<uint32_t> depth_bits;
    Buffer<uint16_t> origins;
    Buffer<uint32_t> counts; // number of splats in each block

    void reserve(size_t blocks, size_t slots)
    {
        splats.reserve(slots);
        depth_bits.reserve(slots);
        origins.reserve(slots);
        counts.reserve(blocks);
    }

    [[nodiscard]] uint64_t bytes() const
    {
        return splats.bytes() + depth_bits.bytes() + origins.bytes() + counts.bytes();
    }
};

// Scratch memory and counters of one worker while it decodes and projects.
struct DecodeState {
    DecodeScratch scratch;
    // With reuse: the Gaussians that a block draws, and those of a strip without an entry
    DecodeScratch gathered;
    Buffer<uint16_t> strip_keys;
    Buffer<float> strip_fixed;
    Buffer<std::byte> strip_packed;
    PackScratch pack;
    uint64_t alive[kMaxEyes], visible[kMaxEyes], dropped[kMaxEyes];
    uint64_t decoded[kMaxEyes], reused[kMaxEyes], overdue[kMaxEyes];
    bool any_positive[kMaxEyes];
    double decode_ms, project_ms;

    void clearCounts()
    {
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            alive[e] = visible[e] = dropped[e] = decoded[e] = reused[e] = overdue[e] = 0;
            any_positive[e] = false;
        }
        decode_ms = project_ms = 0;
    }
};

// Projects a block's Gaussians for eye `e` into the slots of the block, from slot `first` on, and counts them. Returns
// the number of splats.
inline uint32_t projectInto(SplatStore& store, size_t block, size_t first, const ProjectArgs& args,
                            const GaussianBlock& gaussians, uint32_t e, DecodeState& state)
{
    const ProjectCounts counts = projectBlockCpu(args, gaussians, store.splats.data() + first,
                                                 store.depth_bits.data() + first, store.origins.data() + first);
    store.counts[block] = counts.splats;
    state.alive[e] += gaussians.count;
    state.visible[e] += counts.splats;
    state.dropped[e] += counts.dropped;
    state.any_positive[e] |= gaussians.any_positive;
    return counts.splats;
}

// Divides `ms` of wall clock time between decode and project, which alternate in each worker, in the ratio of the
// workers' times.
inline void addShares(const std::vector<DecodeState>& states, double ms, StageTimes& times)
{
    double decode = 0, project = 0;
    for (const DecodeState& state : states) {
        decode += state.decode_ms;
        project += state.project_ms;
    }
    const double share = decode + project > 0 ? decode / (decode + project) : 1;
    times.decode += ms * share;
    times.project += ms * (1 - share);
}

} // namespace gsc
