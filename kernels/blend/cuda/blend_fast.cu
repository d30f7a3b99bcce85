// SPDX-License-Identifier: Apache-2.0
#include "kernels/blend/cuda/blend_kernel.cuh"

namespace gsc {

void blendFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchBlend<FastRules>(FastRules::lifted(args), processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsFastCuda(args, processors, stream);
}

void blendCostFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCost<CostRules<FastRules>>(FastRules::lifted(args), processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsFastCuda(args, processors, stream);
}

void blendDepthsFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchBlend<DepthRules<FastRules>>(args, processors, stream);
}

} // namespace gsc
