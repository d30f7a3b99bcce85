// SPDX-License-Identifier: Apache-2.0
// Tier `exact`, compiled with -fmad=false: gaussianPower() fuses those operations that the trainers' kernel fuses.
#include "kernels/blend/cuda/blend_kernel.cuh"

namespace gsc {

void blendExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    if (args.rules.gsplat)
        launchBlend<ExactRules<true>>(args, processors, stream);
    else
        launchBlend<ExactRules<false>>(args, processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsExactCuda(args, processors, stream);
}

void blendCostExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCost<CostRules<AnyExactRules>>(args, processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsExactCuda(args, processors, stream);
}

void blendDepthsExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchBlend<DepthRules<AnyExactRules>>(args, processors, stream);
}

} // namespace gsc
