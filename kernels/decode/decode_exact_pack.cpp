// SPDX-License-Identifier: Apache-2.0
// Host side of the tiled decode in fp32: weights in the order in which its lanes read them.
#include "kernels/decode/decode_exact_cuda.h"
#include "kernels/math/mlp.h"

#include <algorithm>

namespace gsc {

bool canDecodeTiled(const ModelView& model)
{
    return canDecodeFast(model) && model.params->n_offsets <= kExactOffsets;
}

ExactWeights packExact(const ModelView& model, int32_t appearance)
{
    const ModelParams& params = *model.params;
    const uint32_t A = params.appearance_dim, K = params.n_offsets;
    const float* row =
        model.embedding != nullptr && appearance >= 0 ? model.embedding + size_t(appearance) * A : nullptr;
    ExactWeights out{};
    const MlpKind kinds[3] = {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color};
    const uint32_t outputs[3] = {K, 7 * K, 3 * K}, first_column[3] = {0, 1, 6};
    for (uint32_t head = 0; head < 3; ++head) {
        const MlpRecord& mlp = *mlpRecord(model, kinds[head]);
        const float *weight0 = mlpWeights(model, mlp.weight0), *bias0 = mlpWeights(model, mlp.bias0);
        const float *weight1 = mlpWeights(model, mlp.weight1), *bias1 = mlpWeights(model, mlp.bias1);
        for (uint32_t unit = 0; unit < kExactHidden; ++unit) {
            const float* weights = weight0 + size_t(unit) * mlp.in;
            const uint32_t column = kExactHidden * head + unit;
            uint32_t next = 0;
            for (; next < kFastFeatures + 3; ++next)
                out.first[next][column] = weights[next];
            if (mlp.inputs & kMlpTakesDistance)
                out.first[kFastFeatures + 3][column] = weights[next++];
            if (mlp.inputs & kMlpTakesLevel)
                out.first[kFastFeatures + 4][column] = weights[next++];
            double bias = double(bias0[unit]);
            if ((mlp.inputs & kMlpTakesAppearance) && row != nullptr)
                for (uint32_t a = 0; a < A; ++a)
                    bias += double(weights[next + a]) * double(row[a]);
            out.first_bias[column] = float(bias);
        }
        for (uint32_t o = 0; o < outputs[head]; ++o) {
            const uint32_t column = exactColumn(first_column[head] + o / 16, o % 16);
            for (uint32_t unit = 0; unit < kExactHidden; ++unit)
                out.second[unit][column] = weight1[size_t(o) * kExactHidden + unit];
            out.second_bias[column] = bias1[o];
        }
    }
    return out;
}

} // namespace gsc
