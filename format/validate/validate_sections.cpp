// SPDX-License-Identifier: Apache-2.0
// Fills the spans of the view, after checking every count against the size of its section and against PARM.
#include "format/validate/gsc_validate.h"

namespace gsc::validate {

namespace {

enum class Size { Exact, AtLeast };

// Checks that `count` records are the content of the section, or its beginning. It never multiplies a count of the
// file, which could wrap around.
bool checkSize(Context& context, const SectionEntry& entry, const char* name, uint64_t record_bytes, Size size)
{
    const uint64_t fit = entry.bytes / record_bytes;
    const bool good = size == Size::Exact ? fit == entry.count && entry.bytes % record_bytes == 0 : entry.count <= fit;
    if (!good) {
        const uint64_t expected = entry.count > UINT64_MAX / record_bytes ? UINT64_MAX : entry.count * record_bytes;
        GSC_REPORT(context.log, SectionBytes, entry.offset, formatString("/sections/%s", name), name, entry.bytes,
                   entry.count, expected, size == Size::Exact ? "" : " or more");
    }
    return good;
}

bool checkCount(Context& context, const SectionEntry& entry, const char* name, uint64_t expected)
{
    if (entry.count != expected)
        GSC_REPORT(context.log, SectionCount, entry.offset, formatString("/sections/%s", name), name, entry.count,
                   expected);
    return entry.count == expected;
}

template <typename T>
void bindRecords(Context& context, uint32_t type, const char* name, uint64_t expected, Size size,
                 std::span<const T>& out)
{
    const SectionEntry& entry = *context.entry(type);
    if (!checkCount(context, entry, name, expected) || !checkSize(context, entry, name, sizeof(T), size))
        return;
    if (const auto records = context.file.array<T>(entry.offset, entry.count))
        out = *records;
}

void bindEmbedding(Context& context)
{
    const ModelParams& p = *context.view.params;
    const SectionEntry* const entry = context.entry(kSectionEmbedding);
    if (bool(entry) != (p.appearance_dim > 0)) {
        GSC_REPORT(context.log, EmbeddingUnexpected, entry ? entry->offset : 0, "/embedding",
                   entry ? "present" : "absent", p.appearance_dim);
        return;
    }
    if (!entry || !checkCount(context, *entry, "EMBD", p.appearance_rows))
        return;
    // nothing wraps around: both factors fit 32 bits, and appearance_dim is at most kMaxAppearanceDim
    const uint64_t rows_bytes = alignUp(uint64_t(p.appearance_rows) * sizeof(uint32_t), 64);
    const uint64_t value_count = uint64_t(p.appearance_rows) * p.appearance_dim;
    const uint64_t expected = rows_bytes + value_count * sizeof(float);
    if (entry->bytes != expected) {
        GSC_REPORT(context.log, SectionBytes, entry->offset, "/sections/EMBD", "EMBD", entry->bytes, entry->count,
                   expected, "");
        return;
    }
    const auto rows = context.file.array<uint32_t>(entry->offset, p.appearance_rows);
    const auto values = context.file.array<float>(entry->offset + rows_bytes, value_count);
    context.view.embedding_rows = rows.value_or(context.view.embedding_rows);
    context.view.embedding = values.value_or(context.view.embedding);
}

void bindTile(Context& context)
{
    const SectionEntry* const entry = context.entry(kSectionTile);
    const uint64_t anchors = context.view.header->anchor_count; // fits 32 bits, so no product below wraps around
    if (!entry || !checkCount(context, *entry, "TILE", anchors))
        return;
    const uint64_t expected = sizeof(TileRecord) + anchors * sizeof(uint32_t);
    if (entry->bytes != expected) {
        GSC_REPORT(context.log, SectionBytes, entry->offset, "/sections/TILE", "TILE", entry->bytes, entry->count,
                   expected, "");
        return;
    }
    const auto record = context.file.array<TileRecord>(entry->offset, 1);
    const auto rows = context.file.array<uint32_t>(entry->offset + sizeof(TileRecord), anchors);
    if (record && rows) {
        context.view.tile = record->data();
        context.view.tile_rows = *rows;
    }
}

void bindCameras(Context& context)
{
    const SectionEntry* const entry = context.entry(kSectionCameras);
    if (!entry || !checkSize(context, *entry, "CAMS", sizeof(CameraRecord), Size::AtLeast))
        return;
    const auto records = context.file.array<CameraRecord>(entry->offset, entry->count);
    if (!records)
        return;
    context.view.cameras = *records;
    const auto names = context.content(*entry).subspan(records->size_bytes());
    context.view.camera_names = {reinterpret_cast<const char*>(names.data()), names.size()};
}

} // namespace

bool bindSections(Context& context)
{
    GscView& view = context.view;
    const ModelParams& p = *view.params;
    checkCount(context, *context.entry(kSectionMeta), "META", 0);
    checkCount(context, *context.entry(kSectionAnchors), "ANCH", view.header->anchor_count);
    checkCount(context, *context.entry(kSectionNanoVdb), "NVDB", p.level_count);
    bindRecords(context, kSectionChunks, "CHNK", p.chunk_count, Size::Exact, view.chunks);
    bindRecords(context, kSectionGroups, "GRUP", p.group_count, Size::Exact, view.groups);
    bindRecords(context, kSectionLeaves, "LEAF", p.leaf_count, Size::Exact, view.leaves);
    bindRecords(context, kSectionIndex, "INDX", view.header->anchor_count, Size::Exact, view.index);
    bindRecords(context, kSectionWeights, "MLPW", p.mlp_count, Size::AtLeast, view.mlps);
    std::span<const PackedMlpHeader> packed;
    bindRecords(context, kSectionPacked, "MLPP", 1, Size::AtLeast, packed);
    if (context.entry(kSectionSensitivity))
        bindRecords(context, kSectionSensitivity, "SENS", view.header->anchor_count, Size::Exact, view.sensitivity);
    bindTile(context);
    bindEmbedding(context);
    bindCameras(context);
    view.anchors = context.content(*context.entry(kSectionAnchors));
    view.nanovdb = context.content(*context.entry(kSectionNanoVdb));
    view.weights = context.content(*context.entry(kSectionWeights));
    view.packed = context.content(*context.entry(kSectionPacked));
    return !context.log.fatal();
}

} // namespace gsc::validate
