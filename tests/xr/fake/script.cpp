// SPDX-License-Identifier: Apache-2.0
#include "script.h"

#include <algorithm>
#include <cmath>

namespace gsc::fake_xr {

namespace {

// A display time is a whole number of nanoseconds, so t = 0.1 may be asked for as 0.0999999999.
constexpr double kRounding = 1e-7;

XrQuaternionf operator*(const XrQuaternionf& a, const XrQuaternionf& b)
{
    return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

XrQuaternionf conjugate(const XrQuaternionf& q)
{
    return {-q.x, -q.y, -q.z, q.w};
}

XrVector3f rotate(const XrQuaternionf& q, const XrVector3f& v)
{
    const XrQuaternionf r = q * XrQuaternionf{v.x, v.y, v.z, 0} * conjugate(q);
    return {r.x, r.y, r.z};
}

float dot(const XrQuaternionf& a, const XrQuaternionf& b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

XrPosef between(const XrPosef& a, const XrPosef& b, float u)
{
    const auto mix = [u](float from, float to) { return from + (to - from) * u; };
    const XrQuaternionf &p = a.orientation, &q = b.orientation;
    return {normalized({mix(p.x, q.x), mix(p.y, q.y), mix(p.z, q.z), mix(p.w, q.w)}),
            {mix(a.position.x, b.position.x), mix(a.position.y, b.position.y), mix(a.position.z, b.position.z)}};
}

} // namespace

XrQuaternionf normalized(XrQuaternionf q)
{
    const float length = std::sqrt(dot(q, q));
    return length > 0 ? XrQuaternionf{q.x / length, q.y / length, q.z / length, q.w / length} : kIdentity.orientation;
}

bool isUnit(const XrQuaternionf& q)
{
    return std::abs(std::sqrt(dot(q, q)) - 1) <= 0.01f; // false for NaN
}

XrPosef operator*(const XrPosef& a, const XrPosef& b)
{
    const XrVector3f moved = rotate(a.orientation, b.position);
    return {normalized(a.orientation * b.orientation),
            {a.position.x + moved.x, a.position.y + moved.y, a.position.z + moved.z}};
}

XrPosef inverse(const XrPosef& pose)
{
    const XrQuaternionf back = conjugate(pose.orientation);
    const XrVector3f moved = rotate(back, pose.position);
    return {back, {-moved.x, -moved.y, -moved.z}};
}

XrPosef poseAt(const std::vector<PoseKey>& keys, double t)
{
    const auto after = std::ranges::upper_bound(keys, t, {}, &PoseKey::t);
    if (after == keys.begin())
        return keys.front().pose;
    if (after == keys.end())
        return keys.back().pose;
    const PoseKey& before = after[-1];
    return between(before.pose, after->pose, float((t - before.t) / (after->t - before.t)));
}

XrPosef headAt(const Settings& settings, double t)
{
    if (!settings.head.empty())
        return poseAt(settings.head, t);
    const float yaw = 0.15f * float(std::sin(t)), pitch = 0.05f * float(std::sin(1.3 * t)); // half angles
    const XrQuaternionf turn{0, std::sin(yaw), 0, std::cos(yaw)}, nod{std::sin(pitch), 0, 0, std::cos(pitch)};
    return {normalized(turn * nod), {0.1f * float(std::sin(0.7 * t)), 0.02f * float(std::sin(2 * t)), 0}};
}

bool trackedAt(const Settings& settings, double t)
{
    return std::ranges::none_of(settings.tracking_lost, [t](const auto& span) {
        return t >= span.first - kRounding && t < span.second - kRounding;
    });
}

float inputAt(const Settings& settings, const std::string& path, double t)
{
    float value = 0;
    for (const InputKey& key : settings.inputs)
        if (key.path == path && key.t <= t + kRounding)
            value = key.value;
    return value;
}

} // namespace gsc::fake_xr
