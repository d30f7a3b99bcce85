// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/select/cut_slack.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/common/simd_math-inl.h"
#include "kernels/select/cut.h"

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

// Value of a plane at points, and the share of its summands that is not to be trusted.
template <class D, class V>
HWY_INLINE V cutValue(D d, const float* n, float offset, V x, V y, V z, V reach, V& spare)
{
    const V px = hn::Mul(hn::Set(d, n[0]), x), py = hn::Mul(hn::Set(d, n[1]), y), pz = hn::Mul(hn::Set(d, n[2]), z);
    const V o = hn::Set(d, offset);
    spare = hn::Mul(hn::Set(d, kCutPlaneSlack),
                    hn::Add(hn::Add(hn::Abs(px), hn::Abs(py)), hn::Add(hn::Abs(pz), hn::Add(hn::Abs(o), reach))));
    return hn::Add(hn::Add(hn::Add(px, py), hn::Add(pz, o)), reach);
}

// note: a lane is hidden or visible for good reason, or neither; both margins are above zero for no lane. Comparisons
// are false for NaN, which proves nothing.
void slacksOf(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const GroupLanes& lanes,
              float* slacks)
{
    const LaneTag d;
    using V = hn::Vec<LaneTag>;
    const V zero = hn::Zero(d);
    for (uint32_t i = 0; i < lanes.count; i += uint32_t(hn::Lanes(d))) {
        const V x = hn::Load(d, lanes.x + i), y = hn::Load(d, lanes.y + i), z = hn::Load(d, lanes.z + i);
        const V sigma = expAny(d, hn::Load(d, lanes.log_sigma + i));
        V hidden = zero, spare;
        const auto raise = [&](V margin) { hidden = hn::IfThenElse(hn::Gt(margin, hidden), margin, hidden); };
        for (int p = 0; p < 5; ++p) {
            const BoundPlane& plane = eye.bounds.planes[p];
            const V value =
                cutValue(d, plane.n, plane.offset, x, y, z, hn::Mul(hn::Set(d, plane.sigma_factor), sigma), spare);
            raise(hn::Mul(hn::Neg(hn::Add(value, spare)), hn::Set(d, scales.bounds[p])));
        }
        const V depth = cutValue(d, eye.depth, eye.depth[3], x, y, z, zero, spare);
        // sigma / z below the slope, as a bound of z
        const V least = hn::Max(hn::Set(d, eye.depth_min), hn::Mul(sigma, hn::Set(d, 1 / eye.sigma_slope)));
        const V from_least = hn::Sub(hn::Sub(depth, spare), least);
        const V from_most = hn::Sub(hn::Set(d, eye.depth_max), hn::Add(depth, spare));
        auto proven = hn::And(hn::Gt(from_least, zero), hn::Gt(from_most, zero));
        V visible = hn::Mul(hn::Min(from_least, from_most), hn::Set(d, scales.depth));
        const auto lower = [&](V margin) {
            proven = hn::And(proven, hn::Gt(margin, zero));
            visible = hn::Min(visible, margin);
        };
        for (int p = 0; p < 4; ++p) {
            const V value = cutValue(d, eye.inside[p].n, eye.inside[p].offset, x, y, z, zero, spare);
            lower(hn::Mul(hn::Sub(value, spare), hn::Set(d, scales.inside[p])));
        }
        if (lod.test == LodTest::Distance) {
            const auto shifted = [&](V v, float center) {
                const V delta = hn::Sub(hn::Add(v, hn::Set(d, lod.shift)), hn::Set(d, center));
                return hn::Mul(delta, delta);
            };
            const V squared = hn::Add(hn::Add(shifted(x, eye.bounds.center[0]), shifted(y, eye.bounds.center[1])),
                                      shifted(z, eye.bounds.center[2]));
            const V margin =
                hn::Sub(hn::MulAdd(hn::Set(d, lod.slope), hn::Load(d, lanes.extra_level + i), hn::Set(d, lod.limit)),
                        hn::Mul(hn::Set(d, 0.5f), roughLog(d, squared)));
            // ln(d - t) > ln(d) - u / (1 - u) and ln(d + t) < ln(d) + u, with u = t / d
            const auto motion = [&](V over) {
                const V share = hn::Div(over, hn::Add(over, hn::Set(d, 1.0f)));
                return hn::IfThenElse(hn::Gt(over, zero),
                                      hn::Mul(hn::Mul(hn::Set(d, 0.999f), hn::Sqrt(squared)), share), zero);
            };
            const V spare_level = hn::Set(d, kCutLodSlack);
            raise(motion(hn::Sub(hn::Neg(margin), spare_level)));
            lower(motion(hn::Sub(margin, spare_level)));
        }
        hn::StoreU(hn::IfThenElse(proven, visible, hidden), d, slacks + i);
    }
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(slacksOf);

void laneSlacks(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const GroupLanes& lanes,
                float* slacks)
{
    if (lod.test == LodTest::Never)
        std::fill_n(slacks, lanes.count, kEndlessSlack);
    else
        HWY_DYNAMIC_DISPATCH(slacksOf)(eye, scales, lod, lanes, slacks);
}

} // namespace gsc
#endif
