// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bin/bin_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/bin/bin.h"
#include "kernels/bin/ellipse-inl.h"
#include "kernels/threads/parallel.h"

#include <algorithm>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

// number of splats that are prefetched: they lie in the order of the anchors, not of depth
constexpr size_t kPrefetch = 16;

// Copies splats [begin, end) of the depth order to `splats`, notes the 4 x 4 windows of tiles that each touches, and
// counts the splats per tile in `counts`. That array has grid_x + 1 elements behind its tiles, which may be written to,
// but do not count.
void countTiles(const BinArgs& args, size_t begin, size_t end, Splat* splats, uint32_t* counts,
                std::vector<TileWindow>& windows)
{
    HWY_ALIGN float cell_x[kCells], cell_y[kCells];
    for (uint32_t i = 0; i < kCells; ++i) {
        cell_x[i] = float(i % kCellsPerSide * kTileSize);
        cell_y[i] = float(i / kCellsPerSide * kTileSize);
    }
    constexpr float kSide = float(kTileSize - 1), kNext = float(kTileSize);
    HWY_ALIGN const float two_x[4] = {0, kNext, 0, kNext}, two_y[4] = {0, 0, kNext, kNext};
    const D d;
    const hn::CappedTag<float, 4> d4;
    windows.clear();
    for (size_t i = begin; i < end; ++i) {
        if (i + kPrefetch < end)
            prefetchSplat(args.splats + args.sorted[i + kPrefetch].slot);
        const Splat& splat = splats[i] = args.splats[args.sorted[i].slot];
        const Ellipse ellipse = ellipseOf(splat);
        const uint32_t x0 = splat.x0 / kTileSize, x1 = splat.x1 / kTileSize;
        const uint32_t y0 = splat.y0 / kTileSize, y1 = splat.y1 / kTileSize;
        // in a single row or column of tiles round the centre the ellipse touches all tiles; only if the image cuts the
        // box, some tiles list a splat that draws nothing there
        const bool fills = (x0 == x1 || y0 == y1) && splat.x >= splat.x0 && splat.x <= splat.x1 &&
                           splat.y >= splat.y0 && splat.y <= splat.y1;
        if (x1 - x0 < 2 && y1 - y0 < 2) { // true for most splats, which are counted without branches
            uint32_t four = (x0 == x1 ? 5u : 15u) & (y0 == y1 ? 3u : 15u);
            if (!fills)
                four &= touchedCells(d4, 4, ellipse, two_x, two_y, float(x0 * kTileSize), float(y0 * kTileSize), kSide);
            uint32_t* const at = counts + y0 * args.grid_x + x0;
            at[0] += four & 1u;
            at[1] += four >> 1 & 1u;
            at[args.grid_x] += four >> 2 & 1u;
            at[args.grid_x + 1] += four >> 3;
            windows.push_back({y0 * args.grid_x + x0, uint16_t((four & 3u) | (four & 12u) << 2), 1});
            continue;
        }
        for (uint32_t y = y0; y <= y1; y += kCellsPerSide)
            for (uint32_t x = x0; x <= x1; x += kCellsPerSide) {
                const uint32_t columns = std::min(x1 - x + 1, kCellsPerSide);
                const uint32_t rows = std::min(y1 - y + 1, kCellsPerSide);
                uint32_t tiles = ((1u << columns) - 1) * 0x1111u & ((1u << rows * kCellsPerSide) - 1);
                if (!fills)
                    tiles &= touchedCells(d, kCells, ellipse, cell_x, cell_y, float(x * kTileSize),
                                          float(y * kTileSize), kSide);
                windows.push_back(
                    {y * args.grid_x + x, uint16_t(tiles), uint16_t(x + kCellsPerSide > x1 && y + kCellsPerSide > y1)});
                for (; tiles != 0; tiles &= tiles - 1) {
                    const uint32_t bit = uint32_t(__builtin_ctz(tiles));
                    ++counts[(y + bit / kCellsPerSide) * args.grid_x + x + bit % kCellsPerSide];
                }
            }
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(countTiles);

namespace {

// splats per chunk at least; the cut into chunks depends on the number of splats alone, never on the threads
constexpr size_t kMinChunk = 4096;
constexpr size_t kMaxChunks = 32; // bounds the memory of the counters, of which there is one per chunk and tile

void listTiles(const std::vector<TileWindow>& windows, uint32_t grid_x, uint32_t splat, uint32_t* next,
               uint32_t* entries)
{
    for (const TileWindow& window : windows) {
        for (uint32_t tiles = window.tiles; tiles != 0; tiles &= tiles - 1) {
            const uint32_t bit = uint32_t(__builtin_ctz(tiles));
            entries[next[window.tile + bit / 4 * grid_x + bit % 4]++] = splat;
        }
        splat += window.last;
    }
}

} // namespace

uint64_t binCpu(const BinArgs& args, const Workers& workers, BinScratch& scratch)
{
    // counters per chunk, as countTiles() needs them
    const size_t tiles = size_t(args.grid_x) * args.grid_y, stride = tiles + args.grid_x + 1;
    const size_t chunks = std::clamp<size_t>(args.count / kMinChunk, 1, kMaxChunks);
    const auto chunkFirst = [&](size_t c) { return args.count * c / chunks; };
    scratch.splats.reserve(args.count);
    scratch.tile_first.reserve(tiles + 1);
    scratch.chunk_counts.reserve(chunks * stride);
    scratch.chunk_windows.resize(std::max(scratch.chunk_windows.size(), chunks));

    const auto count = HWY_DYNAMIC_DISPATCH(countTiles);
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c) {
            uint32_t* counts = scratch.chunk_counts.data() + c * stride;
            std::memset(counts, 0, stride * sizeof(uint32_t));
            count(args, chunkFirst(c), chunkFirst(c + 1), scratch.splats.data(), counts, scratch.chunk_windows[c]);
        }
    });
    uint64_t sum = 0;
    for (size_t tile = 0; tile < tiles; ++tile) {
        scratch.tile_first[tile] = uint32_t(sum);
        for (size_t c = 0; c < chunks; ++c) {
            uint32_t& first = scratch.chunk_counts[c * stride + tile];
            const uint32_t n = first;
            first = uint32_t(sum);
            sum += n;
        }
    }
    if (sum > UINT32_MAX)
        throw Error(ErrorCode::OutOfMemory, "frame",
                    formatString("%llu (tile, splat) pairs", static_cast<unsigned long long>(sum)), "fewer than 2^32",
                    "render a smaller image");
    scratch.tile_first[tiles] = uint32_t(sum);
    scratch.entries.reserve(sum);
    workers.run(chunks, 1, [&](size_t begin, size_t end, int) {
        for (size_t c = begin; c < end; ++c)
            listTiles(scratch.chunk_windows[c], args.grid_x, uint32_t(chunkFirst(c)),
                      scratch.chunk_counts.data() + c * stride, scratch.entries.data());
    });
    return sum;
}

} // namespace gsc
#endif
