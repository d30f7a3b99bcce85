// SPDX-License-Identifier: Apache-2.0
// View sensitivities of a chunk while its payload is in memory.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Samples the sensitivity of one model's anchors; chunks may be passed in from any thread. Keeps 4 bytes per anchor.
class SensitivitySampler {
public:
    // `params`: with the model's bounds. `rows`: those of the embedding that are kept; the first one counts.
    SensitivitySampler(const Checkpoint& checkpoint, const ModelParams& params, const std::vector<uint32_t>& rows,
                       uint64_t anchors);

    // The anchors of a built chunk of LOD level `level`: view_sensitivity of the chunk and of its groups is filled in.
    // Returns the seconds it took.
    double addChunk(int32_t level, std::span<const std::byte> payload, ChunkRecord& chunk,
                    std::span<GroupRecord> groups);

    // Records of section SENS, one for each anchor; complete once all chunks were added.
    [[nodiscard]] std::span<const AnchorSensitivity> records() const { return m_records; }

private:
    const ModelParams& m_params;
    std::vector<std::byte> m_weights, m_packed;
    std::vector<float> m_embedding; // one row of the appearance embedding, or empty
    std::vector<AnchorSensitivity> m_records;
};

} // namespace gsc
