// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/stereo_cpu.h"

#include "kernels/math/eye.h"

namespace gsc {

void decodeForBothEyes(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch)
{
    VisibleAnchor anchors[kDecodeBlock];
    for (uint32_t i = 0; i < count; ++i)
        anchors[i] = {args.visible[first + i].chunk, args.visible[first + i].local, 1, {1, 1}};
    DecodeArgs once = args;
    once.eye_count = 1;
    once.visible = anchors;
    once.visible_count = count;
    decodeBlockCpu(once, 0, count, scratch);
}

const GaussianBlock& gaussiansOfEye(const GaussianBlock& all, const VisibleAnchor* visible, uint32_t count,
                                    uint32_t eye, uint32_t n_offsets, GaussianBlock& part)
{
    bool any = false, whole = true;
    for (uint32_t i = 0; i < count; ++i) {
        const bool seen = (visible[i].eyes >> eye & 1) != 0;
        any |= seen;
        whole &= seen && visible[i].fraction[eye] == 1;
    }
    if (whole)
        return all;
    part.count = 0;
    part.any_positive = any && all.any_positive;
    for (uint32_t i = 0; i < all.count; ++i) {
        const VisibleAnchor& anchor = visible[all.origin[i] / n_offsets];
        if ((anchor.eyes >> eye & 1) == 0)
            continue;
        const float opacity = all.opacity[i] * anchor.fraction[eye];
        if (!(opacity >= kOpacityFloor))
            continue;
        const uint32_t to = part.count++;
        for (int c = 0; c < 3; ++c) {
            part.position[c][to] = all.position[c][i];
            part.scale[c][to] = all.scale[c][i];
            part.color[c][to] = all.color[c][i];
        }
        for (int c = 0; c < 4; ++c)
            part.rotation[c][to] = all.rotation[c][i];
        part.opacity[to] = opacity;
        part.origin[to] = all.origin[i];
    }
    return part;
}

} // namespace gsc
