// SPDX-License-Identifier: Apache-2.0
// Tells how fine a picture must be away from where an eye looks, and which Gaussians are drawn in place of finer ones
// (tier `fast` on a GPU). The finest that an eye can tell apart grows linearly with the angle (Weymouth 1958; Guenter
// et al. 2012). A Gaussian smaller than that is drawn with a probability, its area over the wanted area, and if it is
// drawn, it has the wanted area: on average the same is covered (stochastic simplification, Cook et al. 2007). The
// random numbers come from the number of a Gaussian in the source, so that the same ones stay while the eye moves.
#pragma once

#include <gsc/hostdev.h>

#include <cstdint>

namespace gsc {

constexpr float kFoveaInner = 0.97814760f; // cosine of 12 degrees: up to this angle from the gaze everything is drawn
// cosine of 40 degrees: from this angle on the smallest Gaussian is Foveation::smallest
constexpr float kFoveaOuter = 0.76604444f;

// Variance in pixels^2 of the smallest Gaussian that is drawn, at an angle from the gaze with this cosine. `outer`: the
// variance beyond kFoveaOuter. Both 1 - cos and the variance grow with the square of the angle.
GSC_HD float finestVariance(float cosine, float outer)
{
    const float ring = (kFoveaInner - cosine) * (1.0f / (kFoveaInner - kFoveaOuter));
    return outer * (ring < 0 ? 0.0f : ring > 1 ? 1.0f : ring);
}

// Rank of a Gaussian among all, 0 to 1, as a random number: it is drawn if its probability is above its rank. The bits
// come from a good hash (the mixer of Murmur3).
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
