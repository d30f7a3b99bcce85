// SPDX-License-Identifier: Apache-2.0
// Projects coarse copies to splats, as decode does behind its networks. A warp draws a copy, one page at a time.
#include "kernels/coarse/coarse_gaussian.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/decode/fast/emit.cuh"

namespace gsc {

namespace {

constexpr uint32_t kThreads = 256;
constexpr uint32_t kBlocksPerProcessor = 3;

// kShared: as in DecodeFrame. Joined Gaussians are not thinned where no eye looks: instead their cells are larger
// (cellGrowth()).
template <bool kShared>
__global__ void __launch_bounds__(kThreads, kBlocksPerProcessor) drawKernel(const __grid_constant__ CoarseCudaArgs args)
{
    const CoarseTables& tables = args.tables;
    const uint32_t lane = threadIdx.x & 31u;
    const uint32_t warp = (blockIdx.x * kThreads + threadIdx.x) >> 5, warps = gridDim.x * kThreads / 32;
    const uint32_t copies = args.counters->coarse.drawn;
    if (warp >= copies)
        return;
    EyeTally left, right;
    uint32_t positive = 0; // a bit for each eye that sees an opacity above zero
    for (uint32_t i = warp; i < copies; i += warps) {
        const uint32_t entry = tables.drawn[i], index = entry & ((1u << kAnchorBits) - 1), eyes = entry >> kAnchorBits;
        const CoarseGroup& kept = tables.groups[index];
        const CoarseFrame frame = coarseFrame(args.model.groups[index], kept.key.cell);
        const uint32_t count = kept.count;
        positive |= count != 0 ? eyes : 0u;
#pragma unroll 1
        for (uint32_t first = 0; first < count; first += kPageGaussians) {
            const CoarsePage& page = tables.pages[tables.page_of[size_t(index) * kMostPages + first / kPageGaussians]];
            const bool some = first + lane < count;
            const CoarseGaussian gaussian = loadCoarse(page, some ? lane : 0u, frame);
            uint32_t slot = kNoSlot, box = kNoBins;
#pragma unroll 1
            for (uint32_t e = 0; e < args.eye_count; ++e) {
                const auto root = [&](const float* u, const float* v, float& uu, float& uv, float& vv) {
                    const float* l = gaussian.factor;
                    const float pu[3] = {fmaf(u[0], l[0], fmaf(u[1], l[1], u[2] * l[2])), fmaf(u[1], l[3], u[2] * l[4]),
                                         u[2] * l[5]};
                    const float pv[3] = {fmaf(v[0], l[0], fmaf(v[1], l[1], v[2] * l[2])), fmaf(v[1], l[3], v[2] * l[4]),
                                         v[2] * l[5]};
#pragma unroll
                    for (int j = 0; j < 3; ++j) {
                        uu = fmaf(pu[j], pu[j], uu);
                        uv = fmaf(pu[j], pv[j], uv);
                        vv = fmaf(pv[j], pv[j], vv);
                    }
                };
                const auto project = [&](Candidate& out, bool& finite) {
                    return projectRoot<false>(args, e, gaussian.position, root, gaussian.opacity, gaussian.color,
                                              gaussian.order, out, finite);
                };
                SlotWriter writer = kShared || e == 0 ? left.writer : right.writer;
                const Emitted emitted = emitProjected<kShared>(
                    args, e, some && (eyes >> e & 1u) != 0 ? fmaxf(gaussian.opacity, kOpacityFloor) : 0.0f,
                    gaussian.position, project, e + 1 == args.eye_count, slot, box, lane, writer);
                if (e == 0) {
                    addTo(left, emitted);
                    left.writer = writer;
                } else {
                    addTo(right, emitted);
                    (kShared ? left : right).writer = writer;
                }
            }
        }
    }
    finish<kShared>(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish<kShared>(args, 1, right, positive, lane);
}

} // namespace

void loadCoarseDraw()
{
    loadKernel(drawKernel<true>);
    loadKernel(drawKernel<false>);
}

uint32_t coarseDrawGaps(uint32_t processors, uint32_t slot_capacity)
{
    return processors * kBlocksPerProcessor * kThreads / 32 * slotPiece(slot_capacity);
}

void coarseDrawCuda(const CoarseCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCuda(args.shared_bins ? drawKernel<true> : drawKernel<false>, processors * kBlocksPerProcessor, kThreads, 0,
               stream, args);
}

} // namespace gsc
