// SPDX-License-Identifier: Apache-2.0
// Packs the weights for the tiled decoder, on the host, in the order in which the lanes read them.
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/math/mlp.h"

#include <algorithm>

namespace gsc {

bool canDecodeTiled(const ModelView& model)
{
    return canDecodeFast(model) && model.params->n_offsets <= kExactOffsets;
}

ExactWeights packExact(const ModelView& model, int32_t appearance)
{
    const uint32_t A = model.params->appearance_dim, K = model.params->n_offsets;
    const PackedMlpHeader& packed = *reinterpret_cast<const PackedMlpHeader*>(model.packed);
    const float* row =
        model.embedding != nullptr && appearance >= 0 ? model.embedding + size_t(appearance) * A : nullptr;
    ExactWeights out{};
    // the heads lie side by side with no padding between them, since each has kExactHidden units
    const float *first = packedWeights(model, packed.first_f32), *bias = packedWeights(model, packed.first_bias_f32);
    std::copy_n(first, kExactInputs * kExactUnits, &out.first[0][0]);
    for (uint32_t unit = 0; unit < kExactUnits; ++unit) {
        double sum = double(bias[unit]);
        for (uint32_t a = 0; row != nullptr && a < A; ++a)
            sum += double(first[size_t(kExactInputs + a) * kExactUnits + unit]) * double(row[a]);
        out.first_bias[unit] = float(sum);
    }
    const uint32_t outputs[3] = {K, 7 * K, 3 * K}, first_column[3] = {0, 1, 6};
    for (uint32_t head = 0; head < 3; ++head)
        for (uint32_t o = 0; o < outputs[head]; ++o) {
            const uint32_t column = exactColumn(first_column[head] + o / 16, o % 16);
            const float* weights = packedWeights(model, packed.second_f32[head]) + o;
            for (uint32_t unit = 0; unit < kExactHidden; ++unit)
                out.second[unit][column] = weights[size_t(unit) * packed.out_pad[head]];
            out.second_bias[column] = packedWeights(model, packed.second_bias_f32[head])[o];
        }
    return out;
}

} // namespace gsc
