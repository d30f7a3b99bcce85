// SPDX-License-Identifier: Apache-2.0
// Computes the values of schedule.h on a CPU; each lane takes an anchor.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/reuse/schedule_cpu.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "kernels/simd/simd_math-inl.h"
#include "kernels/math/anchor.h"
#include "kernels/reuse/schedule.h"

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace gsc {
namespace HWY_NAMESPACE {

struct Direction {
    V x, y, z, length;
};

HWY_INLINE Direction directionFrom(D d, const float* center, V x, V y, V z)
{
    x = hn::Sub(x, hn::Set(d, center[0]));
    y = hn::Sub(y, hn::Set(d, center[1]));
    z = hn::Sub(z, hn::Set(d, center[2]));
    const V length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
    return {hn::Div(x, length), hn::Div(y, length), hn::Div(z, length), length};
}

float largestChange(const StripAnchors& anchors, uint32_t lanes, const float* c0, const float* c1)
{
    const D d;
    const size_t width = hn::Lanes(d);
    const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    V worst = hn::Zero(d);
    for (size_t i = 0; i < kStripAnchors; i += width) {
        const V x = hn::Load(d, anchors.x + i), y = hn::Load(d, anchors.y + i), z = hn::Load(d, anchors.z + i);
        const Direction a = directionFrom(d, c0, x, y, z), b = directionFrom(d, c1, x, y, z);
        const V dx = hn::Sub(a.x, b.x), dy = hn::Sub(a.y, b.y), dz = hn::Sub(a.z, b.z);
        const V chord = hn::Sqrt(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)));
        const V stretch = hn::Div(hn::Abs(hn::Sub(b.length, a.length)), hn::Min(a.length, b.length));
        V change =
            hn::MulAdd(hn::Load(d, anchors.direction + i), chord, hn::Mul(hn::Load(d, anchors.distance + i), stretch));
        change = hn::IfThenElse(hn::Eq(change, change), change, infinity);
        worst = hn::Max(worst, hn::IfThenElseZero(maskOf(lanes >> i), change));
    }
    return hn::GetLane(hn::MaxOfLanes(d, worst));
}

StripReach reachOf(const StripAnchors& anchors, const float* center)
{
    const D d;
    const size_t width = hn::Lanes(d);
    V rate = hn::Zero(d), weight = hn::Zero(d), nearest = hn::Set(d, std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < kStripAnchors; i += width) {
        const V length =
            directionFrom(d, center, hn::Load(d, anchors.x + i), hn::Load(d, anchors.y + i), hn::Load(d, anchors.z + i))
                .length;
        const V sum = hn::Add(hn::Load(d, anchors.direction + i), hn::Load(d, anchors.distance + i));
        rate = hn::Max(rate, hn::Div(sum, length));
        weight = hn::Max(weight, sum);
        nearest = hn::Min(nearest, length);
    }
    return {hn::GetLane(hn::MaxOfLanes(d, rate)), hn::GetLane(hn::MinOfLanes(d, nearest)),
            hn::GetLane(hn::MaxOfLanes(d, weight))};
}

} // namespace HWY_NAMESPACE
} // namespace gsc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gsc {

HWY_EXPORT(largestChange);
HWY_EXPORT(reachOf);

float stripError(const StripAnchors& anchors, uint32_t lanes, const float* c0, const float* c1)
{
    return HWY_DYNAMIC_DISPATCH(largestChange)(anchors, lanes, c0, c1);
}

StripReach stripReach(const StripAnchors& anchors, const float* center)
{
    return HWY_DYNAMIC_DISPATCH(reachOf)(anchors, center);
}

void loadStripAnchors(const ModelView& model, const uint16_t* sensitivity, const GroupRecord& group, uint32_t strip,
                      StripAnchors& anchors)
{
    const uint32_t first = group.anchor_first - model.chunks[group.chunk].anchor_first;
    for (uint32_t i = 0; i < kStripAnchors; ++i) {
        const uint32_t lane = std::min<uint32_t>(strip * kStripAnchors + i, group.anchor_count - 1);
        const Vec3<float> p = anchorPosition(model, group.chunk, first + lane);
        anchors.x[i] = p.x;
        anchors.y[i] = p.y;
        anchors.z[i] = p.z;
        const uint16_t* halves = sensitivity + 2 * (size_t(group.anchor_first) + lane);
        anchors.direction[i] = std::max(halfValue(halves[0]), kLeastSensitivity);
        anchors.distance[i] = halfValue(halves[1]);
    }
}

} // namespace gsc
#endif
