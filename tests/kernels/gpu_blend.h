// SPDX-License-Identifier: Apache-2.0
// The blend of the device on a scene of blend_scene.h.
#pragma once

#include "kernels/blend/blend_cuda.h"
#include "tests/kernels/blend_scene.h"

#include <type_traits>

namespace gsc::test {

struct Drawn {
    std::vector<float> images[kMaxEyes], depths[kMaxEyes];
    FrameCounters counters;
    std::vector<uint32_t> unfinished, segment_queue; // state of the last pass, see BlendCudaArgs

    bool operator==(const Drawn& other) const // bytes, not values
    {
        for (uint32_t e = 0; e < kMaxEyes; ++e) {
            if (images[e].size() != other.images[e].size())
                return false;
            for (size_t i = 0; i < images[e].size(); ++i)
                if (floatBits(images[e][i]) != floatBits(other.images[e][i]))
                    return false;
            if (depths[e] != other.depths[e])
                return false;
        }
        return true;
    }
};

// Codes of most of the small splats, of others that there is none; of what has no codes, nothing.
std::vector<uint16_t> codesOf(const BlendScene<PackedSplat>& scene, uint32_t& known);
std::vector<uint16_t> codesOf(const BlendScene<ExactSplat>& scene, uint32_t& known);

// Draws the scene in `passes`, each of which takes its part of the splats; the `longest` fullest bins as long lists. codes:
// touchCode() of each splat, or none. has_longest: the fullest has first units, however short it is; else only those that are
// longer have them.
template <typename Splat>
Drawn blendOnDevice(const BlendScene<Splat>& scene, uint32_t passes = 1, uint32_t longest = 0,
                    const std::vector<uint16_t>& codes = {}, bool has_longest = true);

// Every pixel within what rounding explains, and for almost all of them that is little.
template <typename Splat>
void checkPixels(const BlendScene<Splat>& scene, const Drawn& drawn, double usual_bound);

// Bound for checkPixels(). The tier `fast` rounds every exponent by 1e-5 at most (blend_scene.cpp), and the bound
// assumes that all these errors have the same sign.
template <typename Splat>
constexpr double kUsualBound = std::is_same_v<Splat, PackedSplat> ? 6e-5 : 3e-5;

} // namespace gsc::test
