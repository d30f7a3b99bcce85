// SPDX-License-Identifier: Apache-2.0
#include "convert/write/sensitivity_sampler.h"

#include "convert/write/mlp_pack.h"
#include "convert/write/model_sections.h"
#include <gsc/half.h>
#include "kernels/math/anchor.h"
#include "kernels/sensitivity/sensitivity.h"
#include "kernels/threads/stopwatch.h"

#include <algorithm>

namespace gsc {

SensitivitySampler::SensitivitySampler(const Checkpoint& checkpoint, const ModelParams& params,
                                       const std::vector<uint32_t>& rows, uint64_t anchors)
    : m_params(params), m_weights(canonicalMlps(checkpoint.mlps)),
      m_packed(packMlps(checkpoint.mlps, checkpoint.feat_dim, checkpoint.appearance_dim)), m_records(anchors)
{
    if (!rows.empty()) {
        const float* const row = embeddingRow(checkpoint, rows[0]);
        m_embedding.assign(row, row + checkpoint.appearance_dim);
    }
}

double SensitivitySampler::addChunk(int32_t level, std::span<const std::byte> payload, ChunkRecord& chunk,
                                    std::span<GroupRecord> groups)
{
    Stopwatch watch;
    const uint32_t count = chunk.anchor_count;
    // a model of this chunk alone, with only those parts set that viewSensitivityCpu() reads
    ChunkRecord only{};
    LevelRecord only_level{};
    only_level.level = level;
    const ChunkArrays arrays = chunkArrays(m_params, count, payload.data());
    const float* embedding = m_embedding.empty() ? nullptr : m_embedding.data();
    const ModelView model{&m_params,        &only_level,     &only,     nullptr, &arrays,
                          m_weights.data(), m_packed.data(), embedding, nullptr};
    std::vector<float> direction(count), distance(count);
    SensitivityScratch scratch;
    viewSensitivityCpu(model, 0, 0, count, embedding != nullptr ? 0 : -1, direction.data(), distance.data(), scratch);

    const std::span<AnchorSensitivity> records = std::span(m_records).subspan(chunk.anchor_first, count);
    for (uint32_t i = 0; i < count; ++i)
        records[i] = {floatToHalfUp(direction[i]), floatToHalfUp(distance[i])};
    for (GroupRecord& group : groups) {
        uint16_t most = 0;
        for (uint32_t i = 0; i < group.anchor_count; ++i)
            most = std::max(most, m_records[group.anchor_first + i].direction);
        group.view_sensitivity = halfToFloat(most);
        chunk.view_sensitivity = std::max(chunk.view_sensitivity, group.view_sensitivity);
    }
    return watch.lap() / 1000;
}

} // namespace gsc
