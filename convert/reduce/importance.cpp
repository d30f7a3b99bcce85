// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/importance.h"

#include "kernels/blend/blend.h"
#include "kernels/math/anchor.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/decode_state.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace gsc {

namespace {

// Anchors of one chunk that are decoded together.
struct AnchorRun {
    uint32_t chunk, first, count;
};

// Sums of squared weights of the pairs of tiles and splats.
struct Walk {
    const Splat* splats;
    const uint32_t* tile_first;
    const uint32_t* entries;
    uint32_t grid_x;
    const EyeParams& eye;
    const RasterConstants& rules;
    float stop;  // a pixel is done where less would go on
    float* sums; // per entry

    void tile(size_t tile) const
    {
        const auto x0 = uint32_t(tile % grid_x) * kTileSize, y0 = uint32_t(tile / grid_x) * kTileSize;
        const uint32_t x1 = std::min(x0 + kTileSize, eye.width), y1 = std::min(y0 + kTileSize, eye.height);
        float light[kTileSize][kTileSize]; // transmittance, 0 where a pixel is done
        int undone[kTileSize];             // pixels of a row
        for (auto& row : light)
            std::fill(std::begin(row), std::end(row), 1.0f);
        std::fill(std::begin(undone), std::end(undone), int(x1 - x0));
        int open = int((x1 - x0) * (y1 - y0));
        uint32_t i = tile_first[tile];
        for (; i < tile_first[tile + 1] && open > 0; ++i)
            sums[i] = splat(splats[entries[i]], x0, y0, x1, y1, light, undone, open);
        std::fill(sums + i, sums + tile_first[tile + 1], 0.0f);
    }

    float splat(const Splat& s, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1,
                float (&light)[kTileSize][kTileSize], int (&undone)[kTileSize], int& open) const
    {
        const float a = 0.5f * s.conic[0], left = s.x - float(x0), over = a > 1e-9f ? 0.5f / a : 0.0f;
        const int first = std::max(int(s.x0) - int(x0), 0), end = std::min(int(s.x1) + 1, int(x1)) - int(x0);
        float sum = 0;
        for (uint32_t y = std::max<uint32_t>(y0, s.y0); y < std::min<uint32_t>(y1, s.y1 + 1u); ++y) {
            if (undone[y - y0] == 0)
                continue;
            const float dy = s.y - float(y), b = s.conic[1] * dy, c = -0.5f * s.conic[2] * dy * dy;
            // pixels where a dx^2 + b dx - c is below the cutoff: what lies outside could not have reached 1/255
            const float inside = b * b + 4 * a * (c + s.cutoff);
            if (!(inside > 0))
                continue;
            int from = first, to = end;
            if (over > 0) {
                const float half = std::sqrt(inside) * over, mid = left + b * over;
                from = std::max(from, int(std::clamp(mid - half, -1.0f, 32.0f)));
                to = std::min(to, int(std::clamp(mid + half, -1.0f, 32.0f)) + 1);
            }
            if (from >= to)
                continue;
            const int before = undone[y - y0];
            sum += row({a, b, c, left, s.opacity}, from, to, light[y - y0], undone[y - y0]);
            open -= before - undone[y - y0];
        }
        return sum;
    }

    struct Row {
        float a, b, c, left, opacity;
    };

    // Pixels [from, to) of a row of a tile: the trainers' blend step.
    float row(const Row& r, int from, int to, float* light, int& undone) const
    {
        float sum = 0;
        for (int x = from; x < to; ++x) {
            const float t = light[x], dx = r.left - float(x), power = r.c - (r.a * dx + r.b) * dx;
            if (t == 0 || power > 0 || power < -80)
                continue;
            const float y = power * 1.44269504f; // e^power as 2^y, 1e-4 relative: weights need no more
            const int whole = int(y) - 1;
            const float f = y - float(whole);
            const float mantissa = 0.5f + f * (0.3479f + f * (0.11255f + f * 0.03955f));
            const float falloff = mantissa * std::bit_cast<float>((whole + 128) << 23);
            const float alpha = std::min(rules.alpha_cap, r.opacity * falloff);
            if (alpha < 1.0f / 255)
                continue;
            const float next = t * (1 - alpha), w = t * alpha;
            if (next < stop) {
                light[x] = 0;
                --undone;
                continue;
            }
            sum += w * w;
            light[x] = next;
        }
        return sum;
    }
};

} // namespace

struct ImportanceMeter::State {
    State(const ModelView& m, int threads, ChunkRead when_read)
        : model(m), workers(threads), read(std::move(when_read)), states(size_t(workers.count()))
    {
        for (DecodeState& state : states)
            reserveDecode(model, state.scratch);
        const ModelParams& params = *model.params;
        size_t count = 0;
        for (uint32_t c = 0; c < params.chunk_count; ++c) {
            const uint32_t in_chunk = model.chunks[c].anchor_count;
            for (uint32_t first = 0; first < in_chunk; first += kDecodeBlock)
                runs.push_back({c, first, std::min(kDecodeBlock, in_chunk - first)});
            count += in_chunk;
        }
        result.weight.resize(count * params.n_offsets);
        result.place.resize(count * params.n_offsets);
        result.alive.resize(count * params.n_offsets);
        result.seen.resize(count);
    }

    size_t select(const EyeParams& eye, const FrameOptions& options, const ColumnRange& columns)
    {
        SelectCounts counts{};
        return selectCpu({&model, &eye, 1, rules, options.lod_bias, options.lod_fade, columns}, workers, selection,
                         anchors, counts);
    }

    // Every stage of one eye after that, as the CPU's renderer runs them, up to the lists of the tiles. Returns the splats.
    size_t fillTiles(const EyeParams& eye, const FrameOptions& options, const ColumnRange& columns, size_t visible)
    {
        const size_t blocks = (visible + kDecodeBlock - 1) / kDecodeBlock;
        capacity = kDecodeBlock * model.params->n_offsets;
        store.reserve(blocks, blocks * capacity);
        for (DecodeState& state : states)
            state.clearCounts();
        const DecodeArgs args = prepareDecode(model, &eye, 1, anchors.data(), visible, options.appearance, bias);
        workers.run(blocks, 1, [&](size_t begin, size_t end, int worker) {
            DecodeState& state = states[size_t(worker)];
            for (size_t b = begin; b < end; ++b) {
                const size_t first = b * kDecodeBlock;
                decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, visible - first)), state.scratch);
                (void)projectInto(store, b, b * capacity, {&eye, rules, nullptr, columns}, state.scratch.blocks[0], 0,
                                  state);
            }
        });
        const size_t count = sortCpu({&model, anchors.data(), store.depth_bits.data(), store.origins.data(),
                                      store.counts.data(), uint32_t(blocks), capacity},
                                     workers, sort);
        (void)binCpu({store.splats.data(), sort.keys[0].data(), count, tileCount(eye.width), tileCount(eye.height)},
                     workers, bin);
        for (size_t i = 0; read && i < visible; ++i)
            if (i == 0 || anchors[i].chunk != anchors[i - 1].chunk)
                read(anchors[i].chunk);
        return count;
    }

    void countAlive(const float (&centre)[3], int32_t appearance)
    {
        EyeParams eye{};
        std::copy_n(centre, 3, eye.center);
        const DecodeArgs every = prepareDecode(model, &eye, 1, nullptr, 0, appearance, bias);
        workers.run(runs.size(), 1, [&](size_t begin, size_t end, int worker) {
            for (size_t r = begin; r < end; ++r)
                countAliveOf(runs[r], every, states[size_t(worker)].scratch);
        });
    }

    void countAliveOf(const AnchorRun& run, DecodeArgs args, DecodeScratch& scratch)
    {
        VisibleAnchor seen[kDecodeBlock];
        for (uint32_t i = 0; i < run.count; ++i)
            seen[i] = {run.chunk, run.first + i, 1, {1, 1}};
        args.visible = seen;
        args.visible_count = run.count;
        decodeBlockCpu(args, 0, run.count, scratch);
        const size_t first = (size_t(model.chunks[run.chunk].anchor_first) + run.first) * model.params->n_offsets;
        for (uint32_t i = 0; i < scratch.blocks[0].count; ++i) // anchors lie in file order
            ++result.alive[first + scratch.blocks[0].origin[i]];
        // note: another thread may still read a run before this one, and then maps its pages again
        if (read && run.first + run.count == model.chunks[run.chunk].anchor_count)
            read(run.chunk);
    }

    [[nodiscard]] size_t anchorOf(const VisibleAnchor& anchor) const
    {
        return size_t(model.chunks[anchor.chunk].anchor_first) + anchor.local;
    }

    // Adds what the tiles of some columns found of each splat to its slot, in the order of the tiles.
    void addUp(const EyeParams& eye, const ColumnRange& columns, size_t splats)
    {
        of_splat.assign(splats, 0);
        const uint32_t tiles = tileCount(eye.width) * tileCount(eye.height);
        for (uint32_t i = 0; i < bin.tile_first[tiles]; ++i)
            of_splat[bin.entries[i]] += double(sums[i]);
        const uint32_t K = model.params->n_offsets;
        const ColumnRange drawn = columns.within(eye.width);
        for (size_t i = 0; i < splats; ++i) {
            if (of_splat[i] == 0)
                continue;
            const SortKey& key = sort.keys[0][i];
            const uint32_t origin = store.origins[key.slot];
            const VisibleAnchor& anchor = anchors[size_t(key.slot / capacity) * kDecodeBlock + origin / K];
            // where weights fall off like a Gaussian, those squared do with half of its variance; so a step d in the
            // picture costs d^T conic d / 2, and one that is as likely in every direction half of the trace
            const Splat& splat = bin.splats[i];
            const double pixels = double(eye.focal_x) / double(std::bit_cast<float>(key.depth_bits));
            const double trace = double(splat.conic[0]) + double(splat.conic[2]);
            const Found found{anchorOf(anchor) * K + origin % K, of_splat[i], trace, pixels};
            // boxes are cut to the columns: this one may go on beside them
            if ((splat.x0 == drawn.first && drawn.first > 0) || (splat.x1 + 1u >= drawn.end && drawn.end < eye.width))
                parts.push_back(found);
            else
                add(found);
        }
    }

    // What some columns show.
    void lookAt(const EyeParams& eye, const FrameOptions& options, const ColumnRange& columns, size_t visible)
    {
        const size_t splats = fillTiles(eye, options, columns, visible);
        const size_t tiles = size_t(tileCount(eye.width)) * tileCount(eye.height);
        sums.reserve(bin.tile_first[tiles]);
        // gsplat's pixel is done where what goes on equals the bound, too
        const float stop = rules.gsplat ? std::nextafter(rules.stop, 1.0f) : rules.stop;
        const Walk walk{
            bin.splats.data(), bin.tile_first.data(), bin.entries.data(), tileCount(eye.width), eye, rules, stop,
            sums.data()};
        workers.run(tiles, 4, [&](size_t begin, size_t end, int) {
            for (size_t tile = begin; tile < end; ++tile)
                walk.tile(tile);
        });
        addUp(eye, columns, splats);
    }

    // Rounded once a pose, so that it does not matter how that was cut.
    void addParts()
    {
        std::ranges::stable_sort(parts, {}, &Found::slot);
        for (size_t i = 0, end = 0; i < parts.size(); i = end) {
            Found whole = parts[i];
            for (end = i + 1; end < parts.size() && parts[end].slot == whole.slot; ++end)
                whole.sum += parts[end].sum;
            add(whole);
        }
        parts.clear();
    }

    struct Found {
        size_t slot;
        double sum, trace, pixels; // squared weights, of the conic, of a world unit
    };

    void add(const Found& found)
    {
        result.weight[found.slot] += float(found.sum);
        result.place[found.slot] += float(found.sum * 0.5 * found.trace * found.pixels * found.pixels);
    }

    const ModelView& model;
    Workers workers;
    ChunkRead read;
    std::vector<DecodeState> states;
    RasterConstants rules{};
    uint32_t capacity = 0;
    std::vector<AnchorRun> runs; // of the model
    SelectScratch selection;
    Buffer<VisibleAnchor> anchors; // that a pose sees
    Buffer<float> bias;
    SplatStore store;
    SortScratch sort;
    BinScratch bin;
    Buffer<float> sums;
    std::vector<double> of_splat;
    std::vector<Found> parts; // of splats that the edge of some columns may cut
    Importance result;
};

ImportanceMeter::ImportanceMeter(const ModelView& model, int threads, ChunkRead read, uint64_t most_slots)
    : m_state(std::make_unique<State>(model, threads, std::move(read))), m_most_slots(most_slots)
{
}

ImportanceMeter::~ImportanceMeter() = default;

void ImportanceMeter::add(const EyeParams& eye, const FrameOptions& options)
{
    State& s = *m_state;
    ++s.result.poses;
    s.rules = rasterConstants(*s.model.params, options.near_z);
    const size_t visible = s.select(eye, options, {});
    for (size_t i = 0; i < visible; ++i)
        ++s.result.seen[s.anchorOf(s.anchors[i])];
    const std::vector<ColumnRange> bands = pictureBands(eye.width, visible * s.model.params->n_offsets, m_most_slots);
    for (const ColumnRange& columns : bands)
        s.lookAt(eye, options, columns, columns.all() ? visible : s.select(eye, options, columns));
    s.addParts();
}

void ImportanceMeter::lookFrom(const float (&centre)[3], int32_t appearance)
{
    ++m_state->result.places;
    m_state->countAlive(centre, appearance);
}

Importance& ImportanceMeter::found()
{
    return m_state->result;
}

Importance ImportanceMeter::take() &&
{
    return std::move(m_state->result);
}

} // namespace gsc
