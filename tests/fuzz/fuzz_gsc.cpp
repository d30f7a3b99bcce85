// SPDX-License-Identifier: Apache-2.0
// The .gsc reader: whatever the bytes are, it answers, its verdict agrees with the issues it reported, and a view it
// calls good can be walked as a player walks it. The mutator changes fields of small valid files and mostly makes the
// checksums fit again, so that the checks behind them are reached; the rest of the time bytes are just bytes.
#include "tests/format/tiny_gsc.h"
#include "tests/fuzz/input_limit.h"

#include <gsc/gsc_issues.h>
#include <gsc/gsc_reader.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <random>

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t max_size);

namespace {

using gsc::test::TinyGscOptions;

volatile uint64_t g_sink; // keeps the walk alive

template <typename T>
uint64_t sumBytes(std::span<const T> values)
{
    uint64_t sum = 0;
    for (const std::byte b : std::as_bytes(values))
        sum += uint64_t(b);
    return sum;
}

uint64_t walkChunk(const gsc::GscView& view, const gsc::ChunkRecord& chunk)
{
    uint64_t sum = sumBytes(gsc::chunkPayload(view, chunk));
    const gsc::LevelRecord& level = view.levels[chunk.level_index];
    const gsc::ChunkArrayLayout layout = gsc::chunkArrayLayout(*view.params, chunk.anchor_count);
    const std::byte* const payload = gsc::chunkPayload(view, chunk).data();
    for (uint32_t g = chunk.group_first; g < chunk.group_first + chunk.group_count; ++g) {
        const gsc::GroupRecord& group = view.groups[g];
        for (uint32_t a = 0; a < group.anchor_count; ++a) {
            const uint32_t local = group.anchor_first + a - chunk.anchor_first;
            for (uint32_t array = 0; array < uint32_t(gsc::ChunkArray::Count); ++array)
                if (layout.stride[array])
                    sum += uint64_t(payload[layout.offset[array] + layout.stride[array] * (local + 1) - 1]);
            if (view.params->position_encoding == uint32_t(gsc::PositionEncoding::Grid)) {
                gsc::GridPosition position;
                std::memcpy(&position, payload + layout.stride[0] * local, sizeof(position));
                const int32_t quanta = chunk.origin[0] + position.local[0]; // must not overflow
                sum += gsc::gridCoordinate(quanta, level.quantum, level.origin, false) > 0;
            }
        }
    }
    for (uint32_t l = chunk.leaf_first; l < chunk.leaf_first + chunk.leaf_count; ++l)
        sum += view.leaves[l].anchor_first + view.leaves[l].nanovdb_index;
    return sum;
}

uint64_t walk(const gsc::GscView& view)
{
    uint64_t sum = sumBytes(view.sections) + sumBytes(view.nanovdb) + sumBytes(view.embedding);
    for (const gsc::ChunkRecord& chunk : view.chunks)
        sum += walkChunk(view, chunk);
    for (const gsc::LevelRecord& level : view.levels)
        sum += sumBytes(view.nanovdb.subspan(level.nanovdb_offset, level.nanovdb_bytes));
    for (const uint32_t anchor : view.index) // source index -> anchor -> whatever a tool keeps per anchor
        if (anchor >= view.header->anchor_count)
            std::abort();
    for (const gsc::MlpRecord& mlp : view.mlps) {
        sum += sumBytes(view.weights.subspan(mlp.weight0, uint64_t(mlp.in) * mlp.hidden * 4));
        sum += sumBytes(view.weights.subspan(mlp.bias0, mlp.hidden * 4));
        sum += sumBytes(view.weights.subspan(mlp.weight1, uint64_t(mlp.hidden) * mlp.out * 4));
        sum += sumBytes(view.weights.subspan(mlp.bias1, mlp.out * 4));
    }
    gsc::PackedMlpHeader packed;
    std::memcpy(&packed, view.packed.data(), sizeof(packed));
    const uint64_t columns = 3 * packed.hidden_pad;
    sum += sumBytes(view.packed.subspan(packed.first_f32, packed.in_rows * columns * 4));
    sum += sumBytes(view.packed.subspan(packed.first_f16, packed.k_pad * columns * 2));
    for (int h = 0; h < 3; ++h)
        sum += sumBytes(view.packed.subspan(packed.second_f32[h], uint64_t(packed.hidden_pad) * packed.out_pad[h] * 4));
    for (const gsc::CameraRecord& camera : view.cameras)
        sum += view.camera_names.substr(camera.name_offset, camera.name_bytes).size();
    if (view.embedding.size() != uint64_t(view.params->appearance_dim) * view.embedding_rows.size())
        std::abort();
    return sum;
}

bool openAndJudge(std::span<const std::byte> file, gsc::GscCheck check)
{
    bool error = false;
    gsc::GscView view;
    const bool good = gsc::openGsc(file, view, check, [&](const gsc::Issue& issue) {
        error |= issue.info->severity != gsc::Severity::Warning;
        if (issue.detail.empty())
            std::abort();
    });
    if (good == error)
        std::abort();
    if (good)
        g_sink = g_sink + walk(view);
    return good;
}

TinyGscOptions seedOptions(uint32_t kind)
{
    TinyGscOptions o;
    o.anchors = 40;
    o.feat_dim = 4;
    o.n_offsets = 2;
    o.nodes = 2;
    if (kind % 2) {
        o.levels = 2;
        o.level_inputs = true;
    }
    if (kind % 3 == 1) {
        o.appearance_dim = 3;
        o.appearance_rows = 2;
    }
    o.feature_bank = kind % 5 == 1;
    o.float_positions = kind % 7 == 2;
    o.rotation = o.opacity = o.normal = kind % 7 == 3;
    if (kind % 8 == 7) {
        o.anchors = 400;
        o.nodes = 1;
    }
    return o;
}

// Values that break arithmetic.
uint64_t awkward(std::mt19937_64& random, uint64_t old)
{
    switch (random() % 8) {
    case 0:
        return 0;
    case 1:
        return ~0ull;
    case 2:
        return old + random() % 9 - 4;
    case 3:
        return old ^ 1ull << random() % 64;
    case 4:
        return 0x7fc000007fc00000; // two NaNs
    case 5:
        return 0x8000000080000000;
    case 6:
        return old * 2;
    default:
        return random() >> random() % 64;
    }
}

// Changes up to four fields of the header, the table or a section's first or any bytes.
void mutateFields(std::span<std::byte> file, std::mt19937_64& random)
{
    for (uint64_t n = 1 + random() % 4; n > 0; --n) {
        std::span<std::byte> target = file;
        const uint64_t place = random() % 16;
        if (place == 0) {
            target = file.first(sizeof(gsc::FileHeader));
        } else if (place <= 2) {
            target = file.subspan(sizeof(gsc::FileHeader), std::min<size_t>(13 * sizeof(gsc::SectionEntry),
                                                                            file.size() - sizeof(gsc::FileHeader)));
        } else {
            const uint32_t types[] = {gsc::kSectionAnchors, gsc::kSectionMeta,    gsc::kSectionParams,
                                      gsc::kSectionLevels,  gsc::kSectionChunks,  gsc::kSectionGroups,
                                      gsc::kSectionLeaves,  gsc::kSectionNanoVdb, gsc::kSectionIndex,
                                      gsc::kSectionWeights, gsc::kSectionPacked,  gsc::kSectionEmbedding,
                                      gsc::kSectionCameras};
            target = gsc::test::section(file, types[random() % std::size(types)]);
        }
        const size_t width = size_t(1) << random() % 4;
        if (target.size() < width)
            continue;
        const size_t at = random() % (target.size() / width) * width;
        uint64_t value = 0;
        std::memcpy(&value, target.data() + at, width);
        value = awkward(random, value);
        std::memcpy(target.data() + at, &value, width);
    }
}

} // namespace

// The smallest file has a page per section; libFuzzer's own limit of 4 KiB would keep every one of them out.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv)
{
    gsc::test::limitInputs(argc, argv, 131072);
    return 0;
}

extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t max_size, unsigned int seed)
{
    std::mt19937_64 random(seed);
    if (size <= sizeof(gsc::FileHeader) || random() % 50 == 0) {
        const std::vector<std::byte> fresh = gsc::test::tinyGsc(seedOptions(uint32_t(random())));
        if (fresh.size() > max_size)
            return LLVMFuzzerMutate(data, size, max_size);
        std::memcpy(data, fresh.data(), fresh.size());
        return fresh.size();
    }
    if (random() % 8 == 0)
        size = LLVMFuzzerMutate(data, size, max_size);
    if (size <= sizeof(gsc::FileHeader))
        return size;
    const std::span<std::byte> file(reinterpret_cast<std::byte*>(data), size);
    mutateFields(file, random);
    if (random() % 8 != 0)
        gsc::test::reseal(file);
    return size;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    const std::span<const std::byte> file(reinterpret_cast<const std::byte*>(data), size);
    const bool full = openAndJudge(file, gsc::GscCheck::Full);
    const bool index = openAndJudge(file, gsc::GscCheck::Index);
    gsc::GscView view;
    const bool summary = gsc::openGscSummary(file, view, nullptr);
    if ((full && !index) || (index && !summary)) // a deeper check never forgives what a shallower one refuses
        std::abort();
    return 0;
}
