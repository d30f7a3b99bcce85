// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/weights/importance.h"

#include "runtime/cpu/frame_cpu.h"

#include <algorithm>
#include <bit>

namespace gsc {

namespace {

// Anchors of one chunk that are decoded together: [first, first + count) of the chunk.
struct AnchorRun {
    uint32_t chunk, first, count;
};

} // namespace

struct ImportanceMeter::State {
    State(const ModelView& m, int threads, ChunkRead when_read) : model(m), frame(threads), read(std::move(when_read))
    {
        frame.load(model);
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

    void countAlive(const float (&centre)[3], int32_t appearance)
    {
        EyeParams eye{};
        std::copy_n(centre, 3, eye.center);
        const DecodeArgs every = prepareDecode(model, &eye, 1, nullptr, 0, appearance, frame.bias);
        frame.workers.run(runs.size(), 1, [&](size_t begin, size_t end, int worker) {
            for (size_t r = begin; r < end; ++r)
                countAliveOf(runs[r], every, frame.states[size_t(worker)].scratch);
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
        for (uint32_t i = 0; i < scratch.blocks[0].count; ++i) // the anchors of a block lie in the order of the file
            ++result.alive[first + scratch.blocks[0].origin[i]];
        // note: may be called while another thread reads an earlier run of the chunk; that thread's pages are then
        // mapped again
        if (read && run.first + run.count == model.chunks[run.chunk].anchor_count)
            read(run.chunk);
    }

    [[nodiscard]] size_t anchorOf(const VisibleAnchor& anchor) const
    {
        return size_t(model.chunks[anchor.chunk].anchor_first) + anchor.local;
    }

    // Adds the squared weights found in some columns of the picture to the slots of their splats, always in the order
    // of the tiles. `pairs`: number of sums, one per splat and tile.
    void addUp(const EyeParams& eye, const ColumnRange& columns, size_t splats, uint64_t pairs)
    {
        of_splat.assign(splats, 0);
        for (uint64_t i = 0; i < pairs; ++i)
            of_splat[frame.bin.entries[i]] += double(sums[i]);
        const uint32_t K = model.params->n_offsets;
        const ColumnRange drawn = columns.within(eye.width);
        for (size_t i = 0; i < splats; ++i) {
            if (of_splat[i] == 0)
                continue;
            const SortKey& key = frame.sort.keys[0][i];
            const uint32_t origin = frame.stores[0].origins[key.slot];
            const VisibleAnchor& anchor = frame.visible[size_t(key.slot / frame.capacity) * kDecodeBlock + origin / K];
            // weights fall off like a Gaussian, so their squares do with half of its variance: a step d in the picture
            // costs d^T conic d / 2 of the sum; averaged over all directions of a step of length 1, half of the conic's
            // trace
            const Splat& splat = frame.bin.splats[i];
            const double pixels = double(eye.focal_x) / double(std::bit_cast<float>(key.depth_bits));
            const double trace = double(splat.conic[0]) + double(splat.conic[2]);
            const Found found{anchorOf(anchor) * K + origin % K, of_splat[i], trace, pixels};
            // splat boxes are cut at the edges of the columns; a splat at an edge may have more tiles in the next
            // columns
            if ((splat.x0 == drawn.first && drawn.first > 0) || (splat.x1 + 1u >= drawn.end && drawn.end < eye.width))
                parts.push_back(found);
            else
                add(found);
        }
    }

    // Draws some columns of a picture and adds what is found. The anchors seen there are selected already.
    void lookAt(const EyeParams& eye, const FrameOptions& options)
    {
        FrameResult drawn;
        frame.decode(&eye, 1, options, drawn);
        const size_t splats = frame.list(0, eye, frame.blocks(), nullptr, drawn);
        for (size_t i = 0; read && i < frame.visible_count; ++i)
            if (i == 0 || frame.visible[i].chunk != frame.visible[i - 1].chunk)
                read(frame.visible[i].chunk);
        const uint64_t pairs = drawn.eyes[0].pairs;
        if (pairs == 0)
            return;
        sums.reserve(pairs);
        BlendArgs args = frame.listed(eye, rasterConstants(*model.params, options.near_z));
        args.columns = options.columns;
        args.squares = sums.data();
        (void)blendCpu(args, frame.workers);
        addUp(eye, options.columns, splats, pairs);
    }

    // Adds the splats that were cut by edges of columns. Their parts are summed in double and rounded once per pose, so
    // that the result does not depend on where the edges were.
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
        double sum, trace, pixels; // sum of squared weights; trace of the conic; pixels in a world unit at that depth
    };

    void add(const Found& found)
    {
        result.weight[found.slot] += float(found.sum);
        result.place[found.slot] += float(found.sum * 0.5 * found.trace * found.pixels * found.pixels);
    }

    const ModelView& model;
    CpuFrame frame;
    ChunkRead read;
    std::vector<AnchorRun> runs; // all anchors of the model, run by run
    Buffer<float> sums;
    std::vector<double> of_splat;
    std::vector<Found> parts; // found at splats that an edge of the columns may cut
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
    FrameOptions some = options;
    FrameResult unread;
    some.columns = {};
    s.frame.select(&eye, 1, some, unread);
    for (size_t i = 0; i < s.frame.visible_count; ++i)
        ++s.result.seen[s.anchorOf(s.frame.visible[i])];
    const uint64_t slots = s.frame.visible_count * s.model.params->n_offsets;
    for (const ColumnRange& columns : pictureBands(eye.width, slots, m_most_slots)) {
        some.columns = columns;
        if (!columns.all())
            s.frame.select(&eye, 1, some, unread);
        s.lookAt(eye, some);
    }
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
