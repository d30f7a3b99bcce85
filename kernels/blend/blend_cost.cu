// SPDX-License-Identifier: Apache-2.0
#include "kernels/blend/cost_rules.cuh"

namespace gsc {

void blendCostFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCost<CostRules<FastRules>>(FastRules::lifted(args), processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsFastCuda(args, processors, stream);
}

} // namespace gsc
