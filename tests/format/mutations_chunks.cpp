// SPDX-License-Identifier: Apache-2.0
// 4xxx and 5xxx: chunks, groups, leaves and the index. The tiny file has three chunks of about 100 anchors each.
#include "tests/format/mutation.h"

#include <algorithm>
#include <cmath>

namespace gsc::test {

namespace {

using Chunk = ChunkRecord;
using Group = GroupRecord;
using Leaf = LeafRecord;

std::function<void(Bytes&)> chunk(size_t index, void (*change)(Chunk&))
{
    return edit<Chunk>(kSectionChunks, index, change);
}

std::function<void(Bytes&)> group(size_t index, void (*change)(Group&))
{
    return edit<Group>(kSectionGroups, index, change);
}

std::function<void(Bytes&)> leaf(size_t index, void (*change)(Leaf&))
{
    return edit<Leaf>(kSectionLeaves, index, change);
}

std::function<void(Bytes&)> index(void (*change)(uint32_t*))
{
    return [=](Bytes& f) { change(records<uint32_t>(f, kSectionIndex)); };
}

// One chunk of three groups.
TinyGscOptions oneChunk()
{
    TinyGscOptions o;
    o.nodes = 1;
    return o;
}

std::vector<Mutation> chunkRecordMutations()
{
    using namespace issue;
    return {
        {ChunkLevel, chunk(0, [](Chunk& c) { c.level_index = 1; })},
        {ChunkLevel, chunk(3, [](Chunk& c) { c.level_index = 0xffffffff; }), {}, octree()},
        {ChunkAnchors, chunk(1, [](Chunk& c) { --c.anchor_first; })},
        {ChunkAnchors, chunk(0, [](Chunk& c) { c.anchor_count = 0; })},
        {ChunkAnchors, chunk(2, [](Chunk& c) { c.anchor_count = 0xffffffff; })},
        {ChunkGroups, chunk(1, [](Chunk& c) { ++c.group_first; })},
        {ChunkGroups, chunk(0, [](Chunk& c) { c.group_count = 0xffffffff; })},
        {ChunkLeaves, chunk(1, [](Chunk& c) { ++c.leaf_first; })},
        {ChunkLeaves, chunk(2, [](Chunk& c) { c.leaf_count = 0xffffffff; })},
        {ChunkLeaves, chunk(0, [](Chunk& c) { c.leaf_count = 0; })},
        {ChunkCover, chunk(2, [](Chunk& c) { --c.leaf_count; })},
        {ChunkCover, chunk(2, [](Chunk& c) { --c.anchor_count; })},
        {ChunkPayloadBytes, chunk(1, [](Chunk& c) { c.payload_bytes -= 4; }), {ChunkPayloadOffset}},
        {ChunkPayloadBytes, chunk(2, [](Chunk& c) { c.payload_bytes = ~0ull; }), {ChunkPayloadRange}},
        {ChunkPayloadOffset, chunk(0, [](Chunk& c) { c.payload_offset = 64; }), {ChunkPayloadOffset}},
        {ChunkPayloadOffset, chunk(1, [](Chunk& c) { c.payload_offset = 0; }), {ChunkPayloadOffset}},
        {ChunkPayloadRange, chunk(2, [](Chunk& c) { c.payload_offset = ~0ull - 255; }), {ChunkPayloadOffset}},
        {ChunkPayloadRange, chunk(2, [](Chunk& c) { c.payload_offset += 256; }), {ChunkPayloadOffset}},
        {ChunkOrigin, chunk(0, [](Chunk& c) { c.origin[1] += 1; })},
        {ChunkOrigin, chunk(2, [](Chunk& c) { c.origin[2] = 0x7fffff00; })},
        {ChunkDuplicate,
         [](Bytes& f) {
             Chunk* const chunks = records<Chunk>(f, kSectionChunks);
             std::copy_n(chunks[0].origin, 3, chunks[1].origin);
         },
         {LeafOrigin}},
        {ChunkBounds, chunk(0, [](Chunk& c) { c.anchor_min[0] = -1e9f; })},
        {ChunkBounds, chunk(0, [](Chunk& c) { c.anchor_max[0] = NAN; }), {GroupBounds}},
        {ChunkBounds, chunk(0, [](Chunk& c) { c.gaussian_max[2] = INFINITY; })},
        {ChunkBounds, chunk(0, [](Chunk& c) { std::swap(c.gaussian_min[1], c.gaussian_max[1]); }), {GroupBounds}},
        {ChunkValue, chunk(0, [](Chunk& c) { c.anchor_sigma_max = -1; }), {GroupValue}},
        {ChunkValue, chunk(0, [](Chunk& c) { c.gaussian_sigma_max = INFINITY; })},
        {ChunkValue, chunk(0, [](Chunk& c) { c.extra_level_min = NAN; }), {GroupValue}},
        {ChunkValue, chunk(0, [](Chunk& c) { c.view_sensitivity = NAN; })},
        {ChunkReserved, chunk(2, [](Chunk& c) { c.reserved[6] = 1; })},
        {AnchorsBytes, editSections([](std::vector<TinySection>& s) {
             std::vector<std::byte>& payloads = find(s, kSectionAnchors).content;
             payloads.resize(payloads.size() + 512);
         })},
        // the origins of two chunks trade places
        {ChunkOrder,
         [](Bytes& f) {
             Chunk* const chunks = records<Chunk>(f, kSectionChunks);
             std::swap(chunks[0].origin, chunks[1].origin);
         },
         {LeafOrigin}},
    };
}

std::vector<Mutation> groupMutations()
{
    using namespace issue;
    return {
        {GroupChunk, group(1, [](Group& g) { g.chunk = 0xffffffff; })},
        {GroupAnchors, group(1, [](Group& g) { --g.anchor_first; }), {}, oneChunk()},
        {GroupAnchors, group(0, [](Group& g) { g.anchor_count = 129; }), {}, oneChunk()},
        {GroupAnchors, group(2, [](Group& g) { g.anchor_count = 0; }), {}, oneChunk()},
        {GroupLevel, group(0, [](Group& g) { g.level_index = 1; })},
        {GroupBounds, group(0, [](Group& g) { g.anchor_max[0] = 1e9f; })},
        {GroupBounds, group(0, [](Group& g) { g.gaussian_min[0] = -1e9f; })},
        {GroupBounds, group(0, [](Group& g) { g.gaussian_max[0] = NAN; })},
        {GroupBounds, group(0, [](Group& g) { std::swap(g.anchor_min[1], g.anchor_max[1]); }), {PositionBounds}},
        {GroupValue, group(0, [](Group& g) { g.anchor_sigma_max *= 2; })},
        {GroupValue, group(0, [](Group& g) { g.gaussian_sigma_max = NAN; })},
        {GroupValue, group(0, [](Group& g) { g.extra_level_max = 3; }), {}, octree()},
        {GroupValue, group(0, [](Group& g) { g.view_sensitivity = -1; })},
    };
}

std::vector<Mutation> leafMutations()
{
    using namespace issue;
    return {
        {LeafAnchors, leaf(1, [](Leaf& l) { ++l.anchor_first; })},
        {LeafAnchors, leaf(0, [](Leaf& l) { l.anchor_count = 0; })},
        {LeafAnchors, leaf(0, [](Leaf& l) { l.anchor_count = 0xffffffff; })},
        {LeafAnchors,
         [](Bytes& f) { // none in the first, and all that were its in the second
             Leaf* const leaves = records<Leaf>(f, kSectionLeaves);
             leaves[1].anchor_first = leaves[0].anchor_first;
             leaves[1].anchor_count += leaves[0].anchor_count;
             leaves[0].anchor_count = 0;
         }},
        {LeafOrigin, leaf(0, [](Leaf& l) { l.origin[0] += 4; })},
        {LeafOrigin, leaf(0, [](Leaf& l) { l.origin[2] -= 128; })},
        {LeafDuplicate,
         [](Bytes& f) {
             Leaf* const leaves = records<Leaf>(f, kSectionLeaves);
             std::copy_n(leaves[0].origin, 3, leaves[1].origin);
         },
         {PositionLeaf}},
        {LeafNanoVdbRange, leaf(0, [](Leaf& l) { l.nanovdb_index = 0xffffffff; })},
        {LeafNanoVdbDuplicate, leaf(0, [](Leaf& l) { l.nanovdb_index = 0; })},
        {LeafCover,
         [](Bytes& f) {
             const Chunk& first = records<Chunk>(f, kSectionChunks)[0];
             --records<Leaf>(f, kSectionLeaves)[first.leaf_count - 1].anchor_count;
         }},
        {LeafOrder,
         [](Bytes& f) {
             Leaf* const leaves = records<Leaf>(f, kSectionLeaves);
             std::swap(leaves[0].origin, leaves[1].origin);
         },
         {PositionLeaf}},

        {IndexRange, index([](uint32_t* i) { i[7] = 300; }), {SourceIndexMismatch}},
        {IndexRange, index([](uint32_t* i) { i[7] = 0xffffffff; }), {SourceIndexMismatch}},
        {IndexDuplicate, index([](uint32_t* i) { i[7] = i[8]; }), {SourceIndexMismatch}},
    };
}

} // namespace

std::vector<Mutation> chunkMutations()
{
    std::vector<Mutation> all = chunkRecordMutations();
    for (auto* part : {groupMutations, leafMutations})
        for (Mutation& m : part())
            all.push_back(std::move(m));
    return all;
}

} // namespace gsc::test
