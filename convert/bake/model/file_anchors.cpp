// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/model/file_anchors.h"

#include "convert/survey/chunk_values.h"

#include <algorithm>

namespace gsc {

std::vector<AnchorPlace> keptPlaces(const GscView& view, const ReducedModel& model, const std::vector<uint32_t>& order)
{
    std::vector<uint32_t> chunks(view.header->anchor_count); // number of the chunk of every anchor
    for (uint32_t c = 0; c < view.chunks.size(); ++c)
        std::fill_n(chunks.begin() + view.chunks[c].anchor_first, view.chunks[c].anchor_count, c);
    std::vector<AnchorPlace> kept;
    kept.reserve(model.anchors() - model.leftOut());
    for (const uint32_t anchor : order)
        if (!model.isLeftOut(anchor))
            kept.push_back({0, chunks[anchor], anchor});
    return kept;
}

bool FileAnchors::next(AnchorBatch& batch, uint32_t fields, size_t max_rows)
{
    const ModelParams& p = *m_files[0].params; // feat_dim and n_offsets, which are equal in all files
    const size_t rows = std::min(max_rows, m_places.size() - m_next);
    batch.first = m_next;
    batch.count = rows;
    const size_t rest = fields == kAnchorAll ? rows : 0;
    batch.position.resize(3 * rows);
    batch.level.resize(rows);
    batch.extra_level.resize(rows);
    batch.offset.resize(3 * size_t(p.n_offsets) * rest);
    batch.feature.resize(size_t(p.feat_dim) * rest);
    batch.scale.resize(6 * rest);
    batch.rotation.resize(4 * rest);
    batch.opacity.resize(rest);
    batch.normal.assign(3 * rest, 0.0f);
    for (size_t i = 0; i < rows; ++i)
        put(m_places[m_next + i], fields, i, batch);
    m_next += rows;
    return rows != 0;
}

void FileAnchors::put(const AnchorPlace& place, uint32_t fields, size_t at, AnchorBatch& batch) const
{
    const GscView& view = m_files[place.file];
    const ModelParams& p = *view.params;
    const ChunkRecord& chunk = view.chunks[place.chunk];
    const ChunkValues values(view, chunk);
    const uint32_t local = place.anchor - chunk.anchor_first;
    const std::array<float, 3> position = values.position(local);
    std::copy_n(position.data(), 3, &batch.position[3 * at]);
    batch.level[at] = view.levels[chunk.level_index].level;
    const float* const extra = values.values(ChunkArray::ExtraLevel, local);
    batch.extra_level[at] = extra != nullptr ? *extra : 0;
    if (fields != kAnchorAll)
        return;
    const bool own = m_model == nullptr;
    std::copy_n(own ? values.values(ChunkArray::Scale, local) : m_model->scale(place.anchor), 6, &batch.scale[6 * at]);
    std::copy_n(own ? values.values(ChunkArray::Offset, local) : m_model->offset(place.anchor), 3 * p.n_offsets,
                &batch.offset[3 * size_t(p.n_offsets) * at]);
    std::copy_n(own ? values.values(ChunkArray::Feature, local) : m_model->feature(place.anchor), p.feat_dim,
                &batch.feature[size_t(p.feat_dim) * at]);
    const float* const rotation = values.values(ChunkArray::Rotation, local);
    std::copy_n(rotation != nullptr ? rotation : p.constant_rotation, 4, &batch.rotation[4 * at]);
    const float* const opacity = values.values(ChunkArray::Opacity, local);
    batch.opacity[at] = opacity != nullptr ? *opacity : p.constant_opacity;
    if (const float* const normal = values.values(ChunkArray::Normal, local))
        std::copy_n(normal, 3, &batch.normal[3 * at]);
}

} // namespace gsc
