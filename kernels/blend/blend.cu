// SPDX-License-Identifier: Apache-2.0
#include "kernels/blend/blend_kernel.cuh"

namespace gsc {

void blendFastCuda(const BlendCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    const bool cut = args.segment_capacity > 0;
    if (cut)
        blendSegmentsCuda(args, processors, stream);
    launchBlend<FastRules>(args, cut, processors, stream);
    if (args.depth[0] != nullptr)
        launchBlend<DepthRules<FastRules>>(args, false, processors, stream);
}

} // namespace gsc
