// SPDX-License-Identifier: Apache-2.0
// Compiled with -fmad=false, as blend_exact.cu, with which it must agree on where light ends.
#include "kernels/blend/cost_rules.cuh"

namespace gsc {

void blendCostExactCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchCost<CostRules<AnyExactRules>>(args, processors, stream);
    if (args.depth[0] != nullptr)
        blendDepthsExactCuda(args, processors, stream);
}

} // namespace gsc
