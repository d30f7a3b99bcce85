// SPDX-License-Identifier: Apache-2.0
// Computes the view sensitivities of a chunk while its payload is in memory.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/gsc_layout.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Computes the sensitivities of one model's anchors. Chunks may be added from any thread. Takes 4 bytes per anchor.
class SensitivitySampler {
public:
    // `params`: with bounds. `rows`: rows of the appearance embedding that the file keeps; the first one is used.
    // `anchors`: number of all anchors.
    SensitivitySampler(const Checkpoint& checkpoint, const ModelParams& params, const std::vector<uint32_t>& rows,
                       uint64_t anchors);

    // Computes the sensitivities of the anchors of a chunk of level number `level`, and sets view_sensitivity of the
    // chunk and of its groups. Returns the seconds that it took.
    double addChunk(int32_t level, std::span<const std::byte> payload, ChunkRecord& chunk,
                    std::span<GroupRecord> groups);

    // Records of section SENS, one per anchor; complete once all chunks have been added.
    [[nodiscard]] std::span<const AnchorSensitivity> records() const { return m_records; }

private:
    const ModelParams& m_params;
    std::vector<std::byte> m_weights, m_packed;
    std::vector<float> m_embedding; // the row of the appearance embedding that is used; empty if the model has none
    std::vector<AnchorSensitivity> m_records;
};

} // namespace gsc
