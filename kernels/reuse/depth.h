// SPDX-License-Identifier: Apache-2.0
// Strips, the unit of reuse, and ReusePolicy::Depth, Algorithm 1 of the GS-Cache paper; equal on a CPU and a GPU.
#pragma once

#include <gsc/frame_types.h>
#include <gsc/hostdev.h>

#include <cmath>

namespace gsc {

// Anchors of a strip, the unit of decoding and reuse: consecutive anchors of a group, as many as decode takes in one
// vector. A strip is smaller than a group, the unit of selection, since one anchor due makes its whole unit due.
constexpr uint32_t kStripAnchors = 16;
constexpr uint32_t kStripsPerGroup = kGroupSize / kStripAnchors;

// Share (0 to 1) of the visible anchors, of all eyes, that were not visible in the frame before.
GSC_HD float updateRate(uint64_t fresh, uint64_t visible)
{
    return visible > 0 ? float(double(fresh) / double(visible)) : 0.0f;
}

// Number of frames in which an entry may be drawn after the frame that decoded it: the paper's H(update rate).
// `update_rate` is updateRate(): the more of the view is new, the less is reused. The paper names three shapes of the
// function and no constants; the constants are ours.
GSC_HD uint32_t reuseDepth(DepthGuidance guidance, uint32_t max_depth, float update_rate)
{
    const float depth = float(max_depth);
    if (guidance == DepthGuidance::Exponential)
        return uint32_t(depth * std::exp(-5.0f * update_rate) + 0.5f);
    if (guidance == DepthGuidance::Staged)
        return update_rate < 0.05f  ? max_depth
               : update_rate < 0.2f ? max_depth / 2
               : update_rate < 0.5f ? max_depth / 4
                                    : 0;
    return uint32_t(depth * (1.0f - update_rate) + 0.5f);
}

// Returns true if Gaussians decoded in frame `decoded` may be drawn in `frame`. `depth`: reuseDepth().
GSC_HD bool youngEnough(uint64_t frame, uint64_t decoded, uint32_t depth)
{
    return frame - decoded <= depth;
}

} // namespace gsc
