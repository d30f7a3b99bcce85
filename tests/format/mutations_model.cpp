// SPDX-License-Identifier: Apache-2.0
// 3xxx and 9xxx: manifest, parameters, levels and their NanoVDB grids.
#include "tests/format/mutation.h"

#include <cmath>
#include <cstring>
#include <string>

namespace gsc::test {

namespace {

using Params = ModelParams;
using Level = LevelRecord;

std::function<void(Bytes&)> params(void (*change)(Params&))
{
    return edit<Params>(kSectionParams, 0, change);
}

std::function<void(Bytes&)> level(size_t index, void (*change)(Level&))
{
    return edit<Level>(kSectionLevels, index, change);
}

template <typename T>
std::function<void(Bytes&)> grid(size_t offset, T value)
{
    return [=](Bytes& f) { std::memcpy(section(f, kSectionNanoVdb).data() + offset, &value, sizeof(value)); };
}

std::vector<Mutation> manifestMutations()
{
    const auto text = [](std::string manifest) {
        TinyGscOptions o;
        o.manifest = std::move(manifest);
        return Mutation{issue::ManifestText, [](Bytes&) {}, {}, o};
    };
    return {text(""),
            text(" \n"),
            text("[1]"),
            text("[1, {}"),
            text("{}]"),
            text("{\"a\":1"),
            text("{\"\xff\":1}"),
            text("{\"\xc0\xaf\":1}"),
            text("{\"\xed\xa0\x80\":1}"),
            text(std::string("{\"a\0\":1}", 8)),
            text("{\"\xe2\x82\"}")};
}

std::vector<Mutation> paramMutations()
{
    using namespace issue;
    TinyGscOptions bank;
    bank.feature_bank = true;
    TinyGscOptions level_bank = octree();
    level_bank.feature_bank = true;
    TinyGscOptions appearance;
    appearance.appearance_dim = 4;
    appearance.appearance_rows = 3;
    return {
        {ParamFamily, params([](Params& p) { p.family = 4; })},
        {ParamFlagBits, params([](Params& p) { p.flags |= 1u << 11; })},
        {ParamFlagConflict, params([](Params& p) { p.flags |= kModelBankDistance; })},
        {ParamFlagConflict, params([](Params& p) { p.flags |= kModelLodHalfCell; })},
        {ParamFlagConflict, params([](Params& p) { p.flags |= kModelBankLevel; }), {}, bank},
        {ParamFlagConflict, params([](Params& p) { p.flags |= kModelBankDistance; }), {}, level_bank},
        {ParamFeatDim, params([](Params& p) { p.feat_dim = 0; })},
        {ParamFeatDim, params([](Params& p) { p.feat_dim = 1025; })},
        {ParamFeatDim, params([](Params& p) { p.feat_dim = 6; }), {}, bank},
        {ParamOffsetCount, params([](Params& p) { p.n_offsets = 0; })},
        {ParamOffsetCount, params([](Params& p) { p.n_offsets = 0xffffffff; })},
        {ParamAppearance, params([](Params& p) { p.appearance_rows = 1; })},
        {ParamAppearance, params([](Params& p) { p.appearance_dim = 4097; }), {}, appearance},
        {ParamLevelRule, params([](Params& p) { p.level_rule = 1; })},
        {ParamLevelRule, params([](Params& p) { p.level_rule = 5; }), {}, octree()},
        {ParamLevelRule, params([](Params& p) { p.level_rule = 0; }), {}, octree()},
        {ParamFork, params([](Params& p) { p.fork = 1; }), {}, octree()},
        {ParamFork, params([](Params& p) { p.fork = 1025; })},
        {ParamLevels, params([](Params& p) { p.level_count = 0; }), {}, octree()},
        {ParamLevels, params([](Params& p) { p.level_count = 65; }), {}, octree()},
        {ParamLevels, params([](Params& p) { p.level_count = 2; })},
        {ParamLevelClamp, params([](Params& p) { p.level_clamp = -1; })},
        {ParamLevelClamp, params([](Params& p) { p.level_clamp = 1025; })},
        {ParamValue, params([](Params& p) { p.standard_dist = 0; }), {}, octree()},
        {ParamValue, params([](Params& p) { p.near_z = NAN; })},
        {ParamValue, params([](Params& p) { p.lod_scale = 0; })},
        {ParamValue, params([](Params& p) { p.constant_rotation[3] = INFINITY; })},
        {ParamValue, params([](Params& p) { p.constant_opacity = NAN; })},
        {ParamValue, params([](Params& p) { p.voxel_size = 0; }), {LevelQuantum}},
        {ParamPositionEncoding, params([](Params& p) { p.position_encoding = 2; })},
        {ParamRasterRules, params([](Params& p) { p.raster_rules = 2; })},
        {ParamMlpCount, params([](Params& p) { p.mlp_count = 4; })},
        {ParamMlpCount, params([](Params& p) { p.mlp_count = 3; }), {}, bank},
        {ParamPayloadVersion, params([](Params& p) { p.chunk_payload_version = 2; })},
        {ParamTotals, params([](Params& p) { p.chunk_count = 0; })},
        {ParamTotals, params([](Params& p) { p.group_count = ~0ull; })},
        {ParamTotals, params([](Params& p) { p.leaf_count = 301; })},
        {ParamReserved, params([](Params& p) { p.reserved0 = 1; })},
        {ParamReserved, params([](Params& p) { p.reserved[22] = 1; })},
        {ParamBounds, params([](Params& p) { p.bounds_max[1] = INFINITY; })},
        {ParamBounds, params([](Params& p) { std::swap(p.bounds_min[0], p.bounds_max[0]); }), {LevelBounds}},
        {ParamMaxima, params([](Params& p) { ++p.max_chunk_anchors; })},
        {ParamMaxima, params([](Params& p) { p.max_chunk_bytes = 0; })},
    };
}

std::vector<Mutation> levelMutations()
{
    using namespace issue;
    return {
        {LevelOrder, level(1, [](Level& l) { l.level = 0; }), {LevelQuantum}, octree()},
        {LevelValue, level(0, [](Level& l) { l.level = 1; }), {LevelQuantum}},
        {LevelValue, level(1, [](Level& l) { l.level = 1025; }), {LevelQuantum}, octree()},
        {LevelCell, level(0, [](Level& l) { l.cell_log2 = 10; })},
        {LevelCell, level(0, [](Level& l) { l.cell_log2 = 0xffffffff; })},
        {LevelQuantum, level(1, [](Level& l) { l.quantum *= 1.0001f; }), {PositionBounds}, octree()},
        {LevelQuantum, level(0, [](Level& l) { l.quantum = NAN; }), {PositionValue}},
        {LevelOrigin, level(0, [](Level& l) { l.origin = NAN; }), {PositionValue}},
        {LevelRange, level(1, [](Level& l) { l.anchor_first += 1; }), {}, octree()},
        {LevelRange, level(0, [](Level& l) { l.anchor_count = ~0ull; }), {}, octree()},
        {LevelRange, level(1, [](Level& l) { l.chunk_count = 0; }), {}, octree()},
        {LevelRange, level(1, [](Level& l) { l.group_first = ~0ull; }), {}, octree()},
        {LevelRange, level(1, [](Level& l) { l.leaf_count += 1; }), {}, octree()},
        {LevelCover, level(1, [](Level& l) { l.leaf_count -= 1; }), {}, octree()},
        {LevelCover, level(0, [](Level& l) { l.anchor_count -= 1; })},
        {LevelBounds, level(0, [](Level& l) { l.bounds_max[2] += 1; })},
        {LevelBounds, level(0, [](Level& l) { l.bounds_min[2] = NAN; }), {ChunkBounds}},
        {LevelReserved, level(0, [](Level& l) { l.reserved = 1; })},

        {GridRange, level(0, [](Level& l) { l.nanovdb_offset = 32; })},
        {GridRange, level(0, [](Level& l) { l.nanovdb_bytes = ~0ull; })},
        {GridRange, level(0, [](Level& l) { l.nanovdb_bytes = 735; })},
        {GridRange, level(1, [](Level& l) { l.nanovdb_offset = 0; }), {}, octree()},
        {GridMagic, grid(0, uint64_t(0x314244566f6e614e))},
        {GridVersion, grid(16, uint32_t(33u << 21))},
        {GridBytes, grid(32, uint64_t(737))},
        {GridLeaves, grid(672 + 32, uint32_t(0xffffffff))},
        {GridSectionBytes,
         editSections([](std::vector<TinySection>& s) { find(s, kSectionNanoVdb).content.resize(736 + 32); })},
    };
}

} // namespace

std::vector<Mutation> modelMutations()
{
    std::vector<Mutation> all = manifestMutations();
    for (auto* part : {paramMutations, levelMutations})
        for (Mutation& m : part())
            all.push_back(std::move(m));
    return all;
}

} // namespace gsc::test
