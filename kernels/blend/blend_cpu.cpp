// SPDX-License-Identifier: Apache-2.0
// A tile is blended in blocks of 4 x 4 pixels, one vector with AVX-512, two with AVX2. A splat touches only the blocks
// in which its alpha can reach 1/255 and some pixel is not done; whatever is left out could not have changed a pixel.
// note: rows of 16 were tried first; they evaluate half as many pixels again
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/blend/blend_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "kernels/blend/blend.h"
#include "kernels/present/false_colour.h"
#include "kernels/simd/ellipse-inl.h"
#include "kernels/threads/parallel.h"
#include "kernels/simd/simd_math-inl.h"

#include <algorithm>
#include <bit>
#include <cmath>

#ifndef GSC_KERNELS_BLEND_PATCH
#define GSC_KERNELS_BLEND_PATCH
namespace gsc {
constexpr uint32_t kPatchX = 4, kPatchY = 4; // tiles of a task: their splats fit the second cache

inline ColumnRange tileColumns(const BlendArgs& args) // that are drawn
{
    const ColumnRange pixels = args.columns.within(args.width);
    return {pixels.first / kTileSize, tileCount(pixels.end)};
}
} // namespace gsc
#endif

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

constexpr uint32_t kPixels = kTileSize * kTileSize;
constexpr uint32_t kBlock = 4;                     // pixels
constexpr uint32_t kBlockPixels = kBlock * kBlock; // and blocks per tile
constexpr uint32_t kBatch = 32; // splats whose blocks are found before the first of them is blended: the two parts
                                // alternate too slowly for a branch predictor otherwise

// State of a tile while it is blended, block by block, row-major in a block. A pixel that is done has its
// transmittance negated, so that no later splat passes the stop test; its absolute value weighs the background.
struct TileState {
    HWY_ALIGN float transmittance[kPixels];
    HWY_ALIGN float red[kPixels], green[kPixels], blue[kPixels];
    HWY_ALIGN float z[kPixels];                                   // with depths
    HWY_ALIGN float pixel_x[kBlock][kBlockPixels];                // per column of blocks
    HWY_ALIGN float pixel_y[kBlock][kBlockPixels];                // per row of blocks
    HWY_ALIGN float block_x[kBlockPixels], block_y[kBlockPixels]; // first pixel of each block
    uint32_t live;                                                // bit b: some pixel of block b is not done
};

// What a splat needs in every block, broadcast.
template <class V>
struct SplatLanes {
    V x, y, half_a, b, half_c, opacity, red, green, blue, lowest, z;
};

// Blends kCount vectors of pixels, which start at offsets at[] of the planes and belong to blocks at[] / 16. Returns a
// bit per vector: not all of its pixels are done.
// note: two at once, because one alone waits for its own exponential most of the time
template <bool kGsplat, bool kDepth, uint32_t kCount, class D, class V>
HWY_INLINE uint32_t blendVectors(D d, const SplatLanes<V>& s, V alpha_cap, V stop, TileState& state, const uint32_t* at)
{
    using M = hn::Mask<D>;
    const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), floor = hn::Set(d, kOpacityFloor);
    V power[kCount], t[kCount], alpha[kCount], next[kCount];
    M drawn[kCount], passes[kCount], adds[kCount], stops[kCount];
    for (uint32_t i = 0; i < kCount; ++i) {
        const uint32_t block = at[i] / kBlockPixels, part = at[i] % kBlockPixels;
        const V dx = hn::Sub(s.x, hn::Load(d, state.pixel_x[block % kBlock] + part));
        const V dy = hn::Sub(s.y, hn::Load(d, state.pixel_y[block / kBlock] + part));
        // gaussianPower(); halving is exact
        const V squares = hn::MulAdd(dx, hn::Mul(s.half_a, dx), hn::Mul(dy, hn::Mul(s.half_c, dy)));
        const V b_dx = hn::Mul(s.b, dx);
        power[i] = kGsplat ? hn::NegMulAdd(b_dx, dy, squares) : hn::Sub(squares, hn::Mul(dy, b_dx));
    }
    expTimes<kCount>(d, power, s.opacity, alpha);
    for (uint32_t i = 0; i < kCount; ++i) {
        // note: the exponential is garbage outside its range, and the comparison with `lowest` leaves it out
        t[i] = hn::Load(d, state.transmittance + at[i]);
        const M near = hn::And(hn::And(hn::Le(power[i], zero), hn::Ge(power[i], s.lowest)), hn::Gt(t[i], zero));
        alpha[i] = hn::Min(alpha_cap, alpha[i]);
        drawn[i] = hn::And(near, hn::Ge(alpha[i], floor));
        next[i] = hn::Mul(t[i], hn::Sub(one, alpha[i]));
        passes[i] = kGsplat ? hn::Gt(next[i], stop) : hn::Ge(next[i], stop);
        adds[i] = hn::And(drawn[i], passes[i]);
        stops[i] = hn::AndNot(passes[i], drawn[i]);
    }
    uint32_t live = 0;
    for (uint32_t i = 0; i < kCount; ++i) {
        const V added = hn::IfThenElseZero(adds[i], alpha[i]), weight = hn::Mul(added, t[i]);
        const auto add = [&](V color, float* plane) {
            const V before = hn::Load(d, plane + at[i]);
            hn::Store(kGsplat ? hn::MulAdd(weight, color, before) : hn::MulAdd(t[i], hn::Mul(added, color), before), d,
                      plane + at[i]);
        };
        add(s.red, state.red);
        add(s.green, state.green);
        add(s.blue, state.blue);
        if constexpr (kDepth) {
            const V half = hn::Set(d, kHalfLight);
            const M spent = hn::And(adds[i], hn::And(hn::Ge(t[i], half), hn::Lt(next[i], half)));
            if (HWY_UNLIKELY(!hn::AllFalse(d, spent)))
                hn::Store(hn::IfThenElse(spent, s.z, hn::Load(d, state.z + at[i])), d, state.z + at[i]);
        }
        V remaining = hn::IfThenElse(adds[i], next[i], t[i]);
        live |= 1u << i;
        if (HWY_UNLIKELY(!hn::AllFalse(d, stops[i]))) {
            remaining = hn::IfThenElse(stops[i], hn::Neg(t[i]), remaining);
            if (hn::AllTrue(d, hn::Lt(remaining, zero)))
                live &= ~(1u << i);
        }
        hn::Store(remaining, d, state.transmittance + at[i]);
    }
    return live;
}

template <bool kGsplat, bool kDepth>
HWY_INLINE void blendSplat(const Splat& splat, float z, const RasterConstants& rules, uint32_t blocks, TileState& state)
{
    const LaneTag d;
    const uint32_t lanes = uint32_t(hn::Lanes(d));
    const SplatLanes<hn::Vec<LaneTag>> s = {hn::Set(d, splat.x),
                                            hn::Set(d, splat.y),
                                            hn::Set(d, -0.5f * splat.conic[0]),
                                            hn::Set(d, splat.conic[1]),
                                            hn::Set(d, -0.5f * splat.conic[2]),
                                            hn::Set(d, splat.opacity),
                                            hn::Set(d, splat.color[0]),
                                            hn::Set(d, splat.color[1]),
                                            hn::Set(d, splat.color[2]),
                                            hn::Set(d, -splat.cutoff),
                                            hn::Set(d, z)};
    const auto alpha_cap = hn::Set(d, rules.alpha_cap), stop = hn::Set(d, rules.stop);
    while (blocks != 0) {
        const uint32_t block = uint32_t(__builtin_ctz(blocks));
        blocks &= blocks - 1;
        if (lanes == kBlockPixels) { // two blocks at once, while there are two
            const uint32_t other = blocks != 0 ? uint32_t(__builtin_ctz(blocks)) : block;
            blocks &= blocks - 1;
            const uint32_t at[2] = {block * kBlockPixels, other * kBlockPixels};
            if (other == block) {
                if (blendVectors<kGsplat, kDepth, 1>(d, s, alpha_cap, stop, state, at) == 0)
                    state.live &= ~(1u << block);
                return;
            }
            const uint32_t live = blendVectors<kGsplat, kDepth, 2>(d, s, alpha_cap, stop, state, at);
            if (HWY_UNLIKELY(live != 3))
                state.live &= ~((~live & 1u) << block | (~live >> 1 & 1u) << other);
            continue;
        }
        uint32_t live = 0;
        for (uint32_t part = 0; part < kBlockPixels; part += 2 * lanes) {
            const uint32_t at[2] = {block * kBlockPixels + part, block * kBlockPixels + part + lanes};
            live |= blendVectors<kGsplat, kDepth, 2>(d, s, alpha_cap, stop, state, at);
        }
        if (HWY_UNLIKELY(live == 0))
            state.live &= ~(1u << block);
    }
}

void startTile(const BlendArgs& args, uint32_t tile_x, uint32_t tile_y, TileState& state)
{
    std::fill_n(state.red, kPixels, 0.0f);
    std::fill_n(state.green, kPixels, 0.0f);
    std::fill_n(state.blue, kPixels, 0.0f);
    if (args.depth.z != nullptr || args.cost) // blending for the cost finds depths, wanted or not
        std::fill_n(state.z, kPixels, INFINITY);
    state.live = 0;
    for (uint32_t block = 0; block < kBlockPixels; ++block) {
        const uint32_t x0 = tile_x + block % kBlock * kBlock, y0 = tile_y + block / kBlock * kBlock;
        state.block_x[block] = float(x0);
        state.block_y[block] = float(y0);
        if (x0 < args.width && y0 < args.height)
            state.live |= 1u << block;
        for (uint32_t i = 0; i < kBlockPixels; ++i) {
            const uint32_t x = x0 + i % kBlock, y = y0 + i / kBlock;
            // pixels outside the image are done from the start
            state.transmittance[block * kBlockPixels + i] = x < args.width && y < args.height ? 1.0f : -1.0f;
            state.pixel_x[block % kBlock][i] = float(x);
            state.pixel_y[block / kBlock][i] = float(y);
        }
    }
}

void storeTile(const BlendArgs& args, uint32_t tile_x, uint32_t tile_y, const TileState& state)
{
    const uint32_t rows = std::min(kTileSize, args.height - tile_y);
    const uint32_t columns = std::min(kTileSize, args.width - tile_x);
    for (uint32_t y = 0; y < rows; ++y) {
        float* row = args.image + 3 * (size_t(tile_y + y) * args.width + tile_x);
        for (uint32_t x = 0; x < columns; ++x) {
            const uint32_t at = (y / kBlock * kBlock + x / kBlock) * kBlockPixels + y % kBlock * kBlock + x % kBlock;
            const float t = std::abs(state.transmittance[at]);
            row[3 * x] = std::fma(t, args.background[0], state.red[at]);
            row[3 * x + 1] = std::fma(t, args.background[1], state.green[at]);
            row[3 * x + 2] = std::fma(t, args.background[2], state.blue[at]);
            if (args.depth.z != nullptr)
                args.depth.z[(tile_y + y) * args.depth.stride + tile_x + x] = state.z[at];
        }
    }
}

// FrameView::Cost. evaluations: of each block's pixels.
void storeCost(const BlendArgs& args, uint32_t tile_x, uint32_t tile_y, const uint32_t* evaluations)
{
    const uint32_t rows = std::min(kTileSize, args.height - tile_y);
    const uint32_t columns = std::min(kTileSize, args.width - tile_x);
    for (uint32_t y = 0; y < rows; ++y) {
        float* row = args.image + 3 * (size_t(tile_y + y) * args.width + tile_x);
        for (uint32_t x = 0; x < columns; ++x) {
            const FalseColour colour = costColour(evaluations[y / kBlock * kBlock + x / kBlock]);
            row[3 * x] = colour.r;
            row[3 * x + 1] = colour.g;
            row[3 * x + 2] = colour.b;
        }
    }
}

HWY_INLINE void prefetchSplat(const Splat* splat)
{
    hwy::Prefetch(splat);
    hwy::Prefetch(&splat->y1); // may lie in the next cache line
}

template <bool kGsplat, bool kDepth, bool kCost = false>
uint64_t blendTile(const BlendArgs& args, uint32_t tile)
{
    TileState state;
    const uint32_t tile_x = tile % args.grid_x * kTileSize, tile_y = tile / args.grid_x * kTileSize;
    startTile(args, tile_x, tile_y, state);
    uint64_t blocks = 0;
    uint32_t evaluations[kCost ? kBlockPixels : 1] = {};
    const uint32_t* entries = args.entries;
    const uint32_t end = args.tile_first[tile + 1];
    for (uint32_t first = args.tile_first[tile]; first < end && state.live != 0; first += kBatch) {
        const uint32_t count = std::min(kBatch, end - first);
        uint32_t touched[kBatch];
        for (uint32_t i = 0; i < count; ++i) {
            if (first + kBatch + i < end)
                prefetchSplat(args.splats + entries[first + kBatch + i]);
            touched[i] =
                touchedCells(args.splats[entries[first + i]], state.block_x, state.block_y, 0, 0, float(kBlock - 1));
        }
        for (uint32_t i = 0; i < count; ++i) {
            const uint32_t live = touched[i] & state.live;
            blocks += uint32_t(__builtin_popcount(live));
            if constexpr (kCost)
                for (uint32_t block = 0; block < kBlockPixels; ++block)
                    evaluations[block] += live >> block & 1u;
            const uint32_t splat = entries[first + i];
            const float z = kDepth ? std::bit_cast<float>(args.sorted[splat].depth_bits) : 0.0f;
            blendSplat<kGsplat, kDepth>(args.splats[splat], z, args.rules, live, state);
        }
    }
    storeTile(args, tile_x, tile_y, state);
    if constexpr (kCost)
        storeCost(args, tile_x, tile_y, evaluations);
    return blocks * kBlockPixels;
}

// Patches [first, last) of kPatchX x kPatchY tiles of the columns that are drawn, row by row: neighbours share most of their
// splats.
uint64_t blendPatches(const BlendArgs& args, size_t first, size_t last)
{
    const bool gsplat = args.rules.gsplat, depth = args.depth.z != nullptr;
    const auto blend = args.cost ? (gsplat ? blendTile<true, true, true> : blendTile<false, true, true>)
                       : gsplat  ? (depth ? blendTile<true, true> : blendTile<true, false>)
                                 : (depth ? blendTile<false, true> : blendTile<false, false>);
    const ColumnRange tiles = tileColumns(args);
    const uint32_t patches_x = (tiles.end - tiles.first + kPatchX - 1) / kPatchX;
    uint64_t evaluations = 0;
    for (size_t patch = first; patch < last; ++patch) {
        const uint32_t x0 = tiles.first + uint32_t(patch % patches_x) * kPatchX;
        const uint32_t y0 = uint32_t(patch / patches_x) * kPatchY;
        for (uint32_t y = y0; y < std::min(y0 + kPatchY, args.grid_y); ++y)
            for (uint32_t x = x0; x < std::min(x0 + kPatchX, tiles.end); ++x)
                if (args.lens.shows(x * kTileSize / kLensSquare, y * kTileSize / kLensSquare))
                    evaluations += blend(args, y * args.grid_x + x);
    }
    return evaluations;
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <atomic>

namespace gsc {

HWY_EXPORT(blendPatches);

uint64_t blendCpu(const BlendArgs& args, const Workers& workers)
{
    const auto kernel = HWY_DYNAMIC_DISPATCH(blendPatches);
    std::atomic<uint64_t> evaluations{0};
    const ColumnRange tiles = tileColumns(args);
    const size_t patches =
        size_t((tiles.end - tiles.first + kPatchX - 1) / kPatchX) * ((args.grid_y + kPatchY - 1) / kPatchY);
    workers.run(patches, 1, [&](size_t begin, size_t end, int) {
        evaluations.fetch_add(kernel(args, begin, end), std::memory_order_relaxed);
    });
    return evaluations;
}

} // namespace gsc
#endif
