// SPDX-License-Identifier: Apache-2.0
// How fine a picture has to be away from where an eye looks, and which Gaussians stand for those that are finer (tier `fast` on
// a GPU). The finest that an eye tells apart grows linearly with the angle (Weymouth 1958; Guenter et al. 2012). A Gaussian
// that is smaller than that is drawn with a chance, its area over that which is wanted, and if it is drawn, as large: on
// average the same is covered (stochastic simplification, Cook et al. 2007). Chances come from a Gaussian's number in the
// source, so the same ones stay while the eye moves.
#pragma once

#include <gsc/hostdev.h>

#include <cstdint>

namespace gsc {

constexpr float kFoveaInner = 0.97814760f; // cosine of 12 degrees: everything is drawn
constexpr float kFoveaOuter = 0.76604444f; // cosine of 40 degrees: from there on as fine as Foveation::smallest

// Variance in pixels^2 of the finest Gaussian, at an angle from the gaze of that cosine; `outer`: that beyond kFoveaOuter.
// 1 - cos goes with the angle's square, and so does a variance.
GSC_HD float finestVariance(float cosine, float outer)
{
    const float ring = (kFoveaInner - cosine) * (1.0f / (kFoveaInner - kFoveaOuter));
    return outer * (ring < 0 ? 0.0f : ring > 1 ? 1.0f : ring);
}

// Rank of a Gaussian among all, 0 to 1: a Gaussian is drawn if its chance is above its rank. Bits of a good hash
// (Murmur3's mixer).
GSC_HD float foveationRank(uint32_t order)
{
    uint32_t h = order;
    h ^= h >> 16;
    h *= 0x85ebca6bu;
    h ^= h >> 13;
    h *= 0xc2b2ae35u;
    h ^= h >> 16;
    return float(h >> 8) * (1.0f / 16777216.0f);
}

} // namespace gsc
