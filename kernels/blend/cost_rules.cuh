// SPDX-License-Identifier: Apache-2.0
// FrameView::Cost: blending that counts in place of mixing colours. A kernel of its own, so that the one of pictures keeps
// its registers.
#pragma once

#include "kernels/blend/blend_kernel.cuh"

namespace gsc {

// Counts in color[0] how many splats are evaluated for a pixel. As in the picture a pixel that is finished counts on until
// all of its sub-tile are, and what fills up a four does not count.
template <typename Base>
struct CostRules : Base {
    static constexpr bool kSegments = false; // counts add up to those of a list that is not cut

    static __device__ __forceinline__ typename Base::Lit light(const typename Base::Splat& s, const BlendCudaArgs& args,
                                                               float x0, float y0)
    {
        typename Base::Lit lit = Base::light(s, args, x0, y0);
        lit.color[0] = 1.0f; // that of nothing() is 0
        return lit;
    }

    static __device__ __forceinline__ void blend(const typename Base::Lit* const (&splats)[4],
                                                 const BlendCudaArgs& args, const PixelPair& at, const float (&)[2],
                                                 float (&T)[2], float (&color)[2][3])
    {
#pragma unroll
        for (uint32_t p = 0; p < 2; ++p)
#pragma unroll
            for (uint32_t i = 0; i < 4; ++i) {
                color[p][0] += splats[i]->color[0];
                T[p] = Base::pass(*splats[i], args, at.x[p], at.y, T[p]);
            }
    }
};

// Nothing is behind the counts.
template <typename Rules>
void launchCost(BlendCudaArgs args, uint32_t processors, CUstream_st* stream)
{
    args.empty_is_black = false;
    for (float& value : args.background)
        value = 0;
    launchBlend<Rules>(args, processors, stream);
}

} // namespace gsc
