// SPDX-License-Identifier: Apache-2.0
// 8xxx: what the chunk payloads hold.
#include "tests/format/mutation.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace gsc::test {

namespace {

constexpr int kQuantaPerCell = 2; // TinyGscOptions::cell_log2 is 1

// A value of an array of chunk 1.
template <typename T>
std::function<void(Bytes&)> value(ChunkArray array, size_t index, T v)
{
    return [=](Bytes& f) { payloadArray<T>(f, 1, array)[index] = v; };
}

std::function<void(Bytes&)> position(size_t index, void (*change)(GridPosition&))
{
    return [=](Bytes& f) { change(payloadArray<GridPosition>(f, 1, ChunkArray::Position)[index]); };
}

// Two anchors of one cell trade places, all arrays of them; what else names them follows.
void swapWithinCell(Bytes& f)
{
    const ChunkRecord& chunk = records<ChunkRecord>(f, kSectionChunks)[0];
    GridPosition* const at = payloadArray<GridPosition>(f, 0, ChunkArray::Position);
    uint32_t* const source = payloadArray<uint32_t>(f, 0, ChunkArray::SourceIndex);
    for (uint32_t i = 1; i < chunk.anchor_count; ++i) {
        bool same = true;
        for (int axis = 0; axis < 3; ++axis)
            same &= at[i].local[axis] >> 1 == at[i - 1].local[axis] >> 1;
        if (!same)
            continue;
        uint32_t* const index = records<uint32_t>(f, kSectionIndex);
        std::swap(index[source[i]], index[source[i - 1]]);
        std::swap(source[i], source[i - 1]);
        return;
    }
    std::abort(); // the tiny file was to have a shared cell
}

// The first anchor of a leaf that is not its chunk's lowest moves along x, to so many quanta from the leaf's low edge.
std::function<void(Bytes&)> besideLeaf(int quanta)
{
    return [=](Bytes& f) {
        const ChunkRecord& chunk = records<ChunkRecord>(f, kSectionChunks)[1];
        const LeafRecord* leaf = records<LeafRecord>(f, kSectionLeaves) + chunk.leaf_first;
        while (leaf->origin[0] * kQuantaPerCell == chunk.origin[0])
            ++leaf;
        payloadArray<GridPosition>(f, 1, ChunkArray::Position)[leaf->anchor_first - chunk.anchor_first].local[0] =
            uint16_t(leaf->origin[0] * kQuantaPerCell - chunk.origin[0] + quanta);
    };
}

// A file of masked slots one of which is masked in two coordinates alone, or with other bits.
std::function<void(Bytes&)> halfMasked(float third)
{
    return [=](Bytes& f) {
        records<ModelParams>(f, kSectionParams)->flags |= kModelMaskedSlots;
        float* const offset = payloadArray<float>(f, 1, ChunkArray::Offset);
        std::fill_n(offset + 3, 2, std::bit_cast<float>(kMaskedOffset));
        offset[5] = third;
    };
}

// A file that says it is compact, whose values of one array are on no steps. Those of the other are zero.
std::function<void(Bytes&)> compactBut(ChunkArray random)
{
    return [=](Bytes& f) {
        const ModelParams params = *records<ModelParams>(f, kSectionParams);
        records<ModelParams>(f, kSectionParams)->flags |= kModelCompact;
        const bool features = random == ChunkArray::Feature;
        for (uint32_t c = 0; c < params.chunk_count; ++c)
            std::fill_n(payloadArray<float>(f, c, features ? ChunkArray::Offset : ChunkArray::Feature),
                        size_t(records<ChunkRecord>(f, kSectionChunks)[c].anchor_count) *
                            (features ? 3 * params.n_offsets : params.feat_dim),
                        0.0f);
    };
}

TinyGscOptions floats()
{
    TinyGscOptions o;
    o.float_positions = true;
    return o;
}

TinyGscOptions rotations()
{
    TinyGscOptions o;
    o.rotation = true;
    return o;
}

TinyGscOptions dense()
{
    TinyGscOptions o;
    o.anchors = 3000;
    return o;
}

} // namespace

std::vector<Mutation> payloadMutations()
{
    using namespace issue;
    return {
        {PayloadChecksum,
         value<float>(ChunkArray::Opacity, 2, 1.0f),
         {},
         [] {
             TinyGscOptions o;
             o.opacity = true;
             return o;
         }(),
         Seal::None},
        {PayloadPadding, // between two arrays
         [](Bytes& f) {
             const ChunkRecord& chunk = records<ChunkRecord>(f, kSectionChunks)[0];
             const ModelParams& params = *records<ModelParams>(f, kSectionParams);
             const ChunkArrayLayout layout = chunkArrayLayout(params, chunk.anchor_count);
             section(f, kSectionAnchors)[layout.offset[uint32_t(ChunkArray::SourceIndex)] - 1] = std::byte{1};
         }},
        {PayloadPadding, // between two payloads
         [](Bytes& f) {
             const ChunkRecord* const chunks = records<ChunkRecord>(f, kSectionChunks);
             section(f, kSectionAnchors)[chunks[1].payload_offset - 1] = std::byte{1};
         }},
        {PayloadPadding, // behind the last
         editSections([](std::vector<TinySection>& s) {
             std::vector<std::byte>& payloads = find(s, kSectionAnchors).content;
             payloads.resize(alignUp(payloads.size(), kPayloadAlign), std::byte{1});
         })},
        {PositionFlagBits, position(0, [](GridPosition& p) { p.flags = 8; })},
        {PositionFlagBits, position(0, [](GridPosition& p) { p.flags = kNegativeZeroZ; })},
        {PositionLeaf, position(0, [](GridPosition& p) { p.local[0] ^= 0x80; })},
        {PositionLeaf, besideLeaf(8 * kQuantaPerCell), {AnchorOrder}},
        {PositionLeaf, besideLeaf(-1)},
        {PositionValue, value<float>(ChunkArray::Position, 4, NAN), {}, floats()},
        {PositionValue, value<float>(ChunkArray::Position, 4, -INFINITY), {}, floats()},
        {PositionBounds, value<float>(ChunkArray::Position, 4, 1000.0f), {GaussianBounds}, floats()},
        {SourceIndexRange, value<uint32_t>(ChunkArray::SourceIndex, 3, 300)},
        {SourceIndexRange, value<uint32_t>(ChunkArray::SourceIndex, 3, 0xffffffff)},
        {SourceIndexMismatch, value<uint32_t>(ChunkArray::SourceIndex, 3, 0)},
        {ExtraLevelValue, value<float>(ChunkArray::ExtraLevel, 3, 2.5f), {}, octree()},
        {ExtraLevelValue, value<float>(ChunkArray::ExtraLevel, 3, NAN), {}, octree()},
        {ScaleValue, value<float>(ChunkArray::Scale, 3, NAN)},
        {ScaleValue, value<float>(ChunkArray::Scale, 4, 89.0f)},
        {ScaleValue, value<float>(ChunkArray::Scale, 4, INFINITY)},
        {SigmaBound, value<float>(ChunkArray::Scale, 4, 0.0f)},
        {SigmaBound, value<float>(ChunkArray::Scale, 0, 0.0f), {GaussianBounds}},
        {AttributeValue, value<float>(ChunkArray::Offset, 5, NAN)},
        {AttributeValue, halfMasked(0.0f)},
        {CompactValue, compactBut(ChunkArray::Feature)},
        {CompactValue, compactBut(ChunkArray::Offset)},
        {AttributeValue, halfMasked(-NAN)},
        {AttributeValue, value<float>(ChunkArray::Feature, 6, INFINITY)},
        {AttributeValue, value<float>(ChunkArray::Rotation, 7, NAN), {}, rotations()},
        {GaussianBounds, value<float>(ChunkArray::Offset, 5, 1e6f)},
        {AnchorOrder, swapWithinCell, {}, dense()},
    };
}

} // namespace gsc::test
