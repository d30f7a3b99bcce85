// SPDX-License-Identifier: Apache-2.0
#include "runtime/model/model_sensitivity.h"

#include <gsc/half.h>
#include "kernels/sensitivity/sensitivity.h"

namespace gsc {

std::vector<uint16_t> modelSensitivity(const ModelView& model, const Workers& workers)
{
    uint64_t anchors = 0;
    for (uint64_t c = 0; c < model.params->chunk_count; ++c)
        anchors += model.chunks[c].anchor_count;
    std::vector<uint16_t> halves(2 * size_t(anchors));
    workers.run(model.params->group_count, 16, [&](size_t begin, size_t end, int) {
        SensitivityScratch scratch;
        float direction[kGroupSize], distance[kGroupSize];
        for (size_t g = begin; g < end; ++g) {
            const GroupRecord& group = model.groups[g];
            viewSensitivityCpu(model, group.chunk, group.anchor_first - model.chunks[group.chunk].anchor_first,
                               group.anchor_count, model.embedding != nullptr ? 0 : -1, direction, distance, scratch);
            for (uint32_t i = 0; i < group.anchor_count; ++i) {
                uint16_t* to = halves.data() + 2 * (size_t(group.anchor_first) + i);
                to[0] = floatToHalfUp(direction[i]);
                to[1] = floatToHalfUp(distance[i]);
            }
        }
    });
    return halves;
}

} // namespace gsc
