// SPDX-License-Identifier: Apache-2.0
// Blends tiles on a CPU, in blocks of 4 x 4 pixels: one vector with AVX-512, two with AVX2. A splat is evaluated only
// in blocks where its alpha can reach 1/255 and some pixel is not done, which leaves no pixel changed. Splats are taken
// in batches; each block blends its splats of a batch with its pixels in registers. note: rows of 16 pixels were tried
// first; they evaluate half as many pixels again
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/blend/blend_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/blend/blend.h"
#include "kernels/blend/blend_block-inl.h"
#include "kernels/present/false_colour.h"
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <cmath>

#ifndef GSC_KERNELS_BLEND_PATCH
#define GSC_KERNELS_BLEND_PATCH
namespace gsc {
constexpr uint32_t kPatchX = 4, kPatchY = 4; // tiles of a task, so few that their splats fit the second-level cache

inline ColumnRange tileColumns(const BlendArgs& args) // columns of tiles that are drawn
{
    const ColumnRange pixels = args.columns.within(args.width);
    return {pixels.first / kTileSize, tileCount(pixels.end)};
}
} // namespace gsc
#endif

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

void startTile(const BlendArgs& args, uint32_t tile_x, uint32_t tile_y, TileState& state)
{
    std::fill_n(state.transmittance, kPixels, 1.0f);
    std::fill_n(state.red, kPixels, 0.0f);
    std::fill_n(state.green, kPixels, 0.0f);
    std::fill_n(state.blue, kPixels, 0.0f);
    // the cost shows depths too, so they are found even if they are not wanted
    if (args.depth.z != nullptr || args.cost)
        std::fill_n(state.z, kPixels, INFINITY);
    for (uint32_t p = 0; p < kBlockPixels; ++p) {
        state.place_x[p] = float(p % kBlock);
        state.place_y[p] = float(p / kBlock);
    }
    state.live = 0;
    for (uint32_t block = 0; block < kBlockPixels; ++block) {
        const uint32_t x0 = tile_x + block % kBlock * kBlock, y0 = tile_y + block / kBlock * kBlock;
        state.block_x[block] = float(x0);
        state.block_y[block] = float(y0);
        // marks pixels outside the image as done
        const uint32_t columns = std::clamp(int(args.width - x0), 0, int(kBlock));
        const uint32_t rows = std::clamp(int(args.height - y0), 0, int(kBlock));
        state.undone[block] = uint16_t(((1u << columns) - 1) * 0x1111u & ((1u << rows * kBlock) - 1));
        state.live |= uint32_t(state.undone[block] != 0) << block;
    }
}

void storeTile(const BlendArgs& args, uint32_t tile_x, uint32_t tile_y, const TileState& state)
{
    const hn::CappedTag<float, kBlock> d4;
    const uint32_t lanes = uint32_t(hn::Lanes(d4));
    const uint32_t rows = std::min(kTileSize, args.height - tile_y);
    const uint32_t columns = std::min(kTileSize, args.width - tile_x);
    for (uint32_t y = 0; y < rows; ++y)
        for (uint32_t x = 0; x < columns; x += lanes) {
            const uint32_t at = (y / kBlock * kBlock + x / kBlock) * kBlockPixels + y % kBlock * kBlock + x % kBlock;
            const auto t = hn::Load(d4, state.transmittance + at);
            const auto over = [&](const float* plane, int c) {
                return hn::MulAdd(t, hn::Set(d4, args.background[c]), hn::Load(d4, plane + at));
            };
            float* pixels = args.image + 3 * (size_t(tile_y + y) * args.width + tile_x + x);
            HWY_ALIGN float some[3 * kBlock];
            const uint32_t count = std::min(lanes, columns - x);
            hn::StoreInterleaved3(over(state.red, 0), over(state.green, 1), over(state.blue, 2), d4,
                                  count == lanes ? pixels : some);
            if (count < lanes)
                std::copy_n(some, 3 * count, pixels);
            if (args.depth.z != nullptr)
                std::copy_n(state.z + at, count, args.depth.z + (tile_y + y) * args.depth.stride + tile_x + x);
        }
}

// Writes a tile's picture for FrameView::Cost. evaluations: number for the pixels of each block.
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

// Writes BlendArgs::squares of `count` entries, and sets the sums to zero for the next batch.
void storeSquares(float (*squares)[kBlockPixels], uint32_t count, float* to)
{
    const D d;
    for (uint32_t i = 0; i < count; ++i) {
        to[i] = hn::GetLane(hn::SumOfLanes(d, hn::Load(d, squares[i])));
        std::fill_n(squares[i], kBlockPixels, 0.0f);
    }
}

template <Find kFind>
uint64_t blendTile(const BlendArgs& args, const BlendRules& rules, uint32_t tile)
{
    TileState state;
    SplatBatch batch;
    const uint32_t tile_x = tile % args.grid_x * kTileSize, tile_y = tile / args.grid_x * kTileSize;
    const uint32_t begin = args.tile_first[tile], end = args.tile_first[tile + 1];
    for (uint32_t i = begin; i < std::min(begin + kBatch, end); ++i)
        prefetchSplat(args.splats + args.entries[i]);
    startTile(args, tile_x, tile_y, state);
    uint64_t blocks = 0;
    uint32_t evaluations[kFind == Find::Cost ? kBlockPixels : 1] = {};
    HWY_ALIGN float squares[kFind == Find::Squares ? kBatch : 1][kBlockPixels] = {};
    if constexpr (kFind == Find::Squares)
        std::fill(args.squares + begin, args.squares + end, 0.0f);
    for (uint32_t first = begin; first < end && state.live != 0; first += kBatch) {
        const uint32_t count = std::min(kBatch, end - first);
        prepareBatch(args, args.entries + first, count, end - first, findsDepths(kFind), state, batch);
        for (uint32_t live = state.live; live != 0; live &= live - 1) {
            const uint32_t block = uint32_t(__builtin_ctz(live));
            uint32_t visited = 0;
            for (uint32_t part = 0; part < kBlockPixels; part += uint32_t(hn::Lanes(D())))
                visited = std::max(
                    visited, blendVector<kFind>(batch, rules, batch.blocks[block], {block, part}, state, squares));
            blocks += visited;
            if constexpr (kFind == Find::Cost)
                evaluations[block] += visited;
            if (state.undone[block] == 0)
                state.live &= ~(1u << block);
        }
        if constexpr (kFind == Find::Squares)
            storeSquares(squares, count, args.squares + first);
    }
    if constexpr (kFind != Find::Squares)
        storeTile(args, tile_x, tile_y, state);
    if constexpr (kFind == Find::Cost)
        storeCost(args, tile_x, tile_y, evaluations);
    return blocks * kBlockPixels;
}

// Blends patches [first, last), each kPatchX x kPatchY tiles, numbered row by row in the columns that are drawn:
// neighbouring tiles share most of their splats.
uint64_t blendPatches(const BlendArgs& args, size_t first, size_t last)
{
    const auto blend = args.squares != nullptr   ? blendTile<Find::Squares>
                       : args.cost               ? blendTile<Find::Cost>
                       : args.depth.z != nullptr ? blendTile<Find::Depths>
                                                 : blendTile<Find::Colours>;
    // with gsplat's rules a pixel is also done if the remaining light equals the bound
    const float bound = args.rules.gsplat ? std::nextafter(args.rules.stop, 1.0f) : args.rules.stop;
    const D d;
    const float faintest = hn::GetLane(logOpacity(d, hn::Set(d, kOpacityFloor)));
    static const OctaveTable octave;
    const BlendRules rules = {args.rules.alpha_cap, faintest, bound, args.rules.gsplat, octave};
    const ColumnRange tiles = tileColumns(args);
    const uint32_t patches_x = (tiles.end - tiles.first + kPatchX - 1) / kPatchX;
    uint64_t evaluations = 0;
    for (size_t patch = first; patch < last; ++patch) {
        const uint32_t x0 = tiles.first + uint32_t(patch % patches_x) * kPatchX;
        const uint32_t y0 = uint32_t(patch / patches_x) * kPatchY;
        for (uint32_t y = y0; y < std::min(y0 + kPatchY, args.grid_y); ++y)
            for (uint32_t x = x0; x < std::min(x0 + kPatchX, tiles.end); ++x)
                if (args.lens.shows(x * kTileSize / kLensSquare, y * kTileSize / kLensSquare))
                    evaluations += blend(args, rules, y * args.grid_x + x);
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
