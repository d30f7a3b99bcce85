// SPDX-License-Identifier: Apache-2.0
// Small valid .gsc files in memory, made without gsc_format's writer, for every test that needs one to open or break.
#pragma once

#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace gsc::test {

struct TinyGscOptions {
    uint32_t anchors = 300;     // anchors of all levels; at least two per level
    uint32_t levels = 1;        // 1 = Scaffold-GS, 2 or more = Octree-GS
    float grid_origin = -1.75f; // for Octree-GS, along every axis
    uint32_t feat_dim = 8;
    uint32_t n_offsets = 3;
    uint32_t cell_log2 = 1;
    uint32_t nodes = 3; // chunks per level, at most 8, fewer if anchors are few
    uint32_t cameras = 2;
    uint32_t appearance_dim = 0;
    uint32_t appearance_rows = 0;
    bool float_positions = false;
    bool feature_bank = false;
    bool distance_inputs = true; // inputs of the three heads
    bool level_inputs = false;   // inputs of the three heads; needs levels >= 2
    bool rotation = false, opacity = false, normal = false;
    bool sensitivity = false;
    bool tile = false; // every second row of a model of twice the size
    uint64_t seed = 1;
    std::string manifest = R"({"schema":"gsc.manifest/1","generator":"tiny_gsc"})";

    // A grid for the leaves of a level, which may set their nanovdb_index. Without it: the head of a NanoVDB grid with
    // the right counts and no nodes, enough for everything but NanoVDB itself.
    std::function<std::vector<std::byte>(const LevelRecord&, std::span<LeafRecord>)> build_grid;
};

// Deterministic on every platform; passes openGsc() with GscCheck::Full and without a warning.
std::vector<std::byte> tinyGsc(const TinyGscOptions& options = {});

// Section of an image, empty if there is none of that type. The table must be sound.
std::span<std::byte> section(std::span<std::byte> file, uint32_t type);
SectionEntry* sectionEntry(std::span<std::byte> file, uint32_t type);

template <typename T>
T* records(std::span<std::byte> file, uint32_t type)
{
    return reinterpret_cast<T*>(section(file, type).data());
}

inline FileHeader& header(std::span<std::byte> file)
{
    return *reinterpret_cast<FileHeader*>(file.data());
}

// An array of the payload of chunk `chunk`; null if the model has no such array.
template <typename T>
T* payloadArray(std::span<std::byte> file, uint32_t chunk, ChunkArray array)
{
    const ChunkRecord& record = records<ChunkRecord>(file, kSectionChunks)[chunk];
    const ChunkArrayLayout layout = chunkArrayLayout(*records<ModelParams>(file, kSectionParams), record.anchor_count);
    if (layout.stride[uint32_t(array)] == 0)
        return nullptr;
    return reinterpret_cast<T*>(section(file, kSectionAnchors).data() + record.payload_offset +
                                layout.offset[uint32_t(array)]);
}

// A section as assembleGsc() takes it; offset, bytes and checksum of the entry are filled in by it.
struct TinySection {
    SectionEntry entry;
    std::vector<std::byte> content;
};

// Lays sections out behind a header and seals the whole.
std::vector<std::byte> assembleGsc(FileHeader header, std::vector<TinySection> sections);

// Takes a file apart, to change the set or the order of its sections.
std::vector<TinySection> takeApart(std::span<std::byte> file);

// Makes every checksum true again after a change: payloads, sections, header. Safe on any bytes: what does not lie in
// the file is left alone.
void reseal(std::span<std::byte> file);

// Exact-size copy on the heap, so that AddressSanitizer sees a read of even one byte too many.
struct HeapCopy {
    explicit HeapCopy(std::span<const std::byte> source);
    std::unique_ptr<std::byte[]> data;
    size_t size;
    [[nodiscard]] std::span<const std::byte> bytes() const { return {data.get(), size}; }
};

} // namespace gsc::test
