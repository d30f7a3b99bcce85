// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/lighting.h"

#include <algorithm>
#include <iterator>

namespace gsc {

namespace {

constexpr double kCloseReach = 3.5; // metres within which a wall darkens what is near it
// metres; a point this close to a box lies on it and is not darkened by it
constexpr double kOwnWall = 0.004;
constexpr dvec3 kSunColor{1.70, 1.46, 1.08};
constexpr dvec3 kSkyColor{0.29, 0.37, 0.54};
constexpr dvec3 kBounceColor{0.20, 0.18, 0.15};

// Metres of the ray from `p` in direction `d` that lie inside the box; negative if the ray misses it.
double rayDepth(const Box& b, dvec3 p, dvec3 d)
{
    double enter = 0, leave = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(d[axis]) < 1e-9) {
            if (p[axis] < b.min[axis] || p[axis] > b.max[axis])
                return -1e9;
            continue;
        }
        const double a = (b.min[axis] - p[axis]) / d[axis], c = (b.max[axis] - p[axis]) / d[axis];
        enter = std::max(enter, std::min(a, c));
        leave = std::min(leave, std::max(a, c));
    }
    return leave - enter;
}

double boxDistance(const Box& b, dvec3 p)
{
    return length(glm::max(glm::max(b.min - p, 0.0), p - b.max));
}

bool overlaps(const Box& a, const Box& b)
{
    // note: written out because glm::all() tests every axis, and this runs for each cell and box
    return a.min.x < b.max.x && a.max.x > b.min.x && a.min.y < b.max.y && a.max.y > b.min.y && a.min.z < b.max.z &&
           a.max.z > b.min.z;
}

} // namespace

SceneLight::SceneLight(const SceneSpec& spec, const SceneTile& tile)
    : m_spec(spec), m_sun(sunDirection(spec.scene)), m_top(0)
{
    for (const Box& b : tile.boxes) {
        m_top = std::max(m_top, b.max.z);
        m_all.sun_boxes.push_back(&b);
    }
    m_all.close_boxes = m_all.sun_boxes;
    for (const BlobOccluder& b : tile.blobs) {
        m_top = std::max(m_top, b.center.z + b.radii.z);
        m_all.sun_blobs.push_back(&b);
    }
}

void SceneLight::gather(const Box& region, const NearOccluders* from, NearOccluders& out) const
{
    const double reach = std::max(0.0, m_top - region.min.z) / m_sun.z;
    const dvec3 end = m_sun * reach; // towards the sun, up to the height of the highest occluder
    Box swept{glm::min(region.min, region.min + end), glm::max(region.max, region.max + end)};
    swept.max.z = 1e9;
    const bool room = m_spec.scene == SampleScene::Room;
    // for a single cell, the ray from its centre is tested too, because the box round the ray is far larger
    const dvec3 middle = (region.min + region.max) * 0.5, half = (region.max - region.min) * 0.5;
    const NearOccluders& known = from ? *from : m_all;
    const auto pick = [](const auto& all, auto& some, const auto& test) {
        some.clear();
        std::copy_if(all.begin(), all.end(), std::back_inserter(some), test);
    };
    pick(known.sun_boxes, out.sun_boxes, [&](const Box* b) {
        return room || (overlaps(swept, *b) && (!from || rayDepth({b->min - half, b->max + half}, middle, m_sun) > 0));
    });
    pick(known.sun_blobs, out.sun_blobs, [&](const BlobOccluder* b) {
        if (!overlaps(swept, {b->center - b->radii * 1.1, b->center + b->radii * 1.1}))
            return false;
        const double reach_of = 1.5 * std::max(b->radii.x, b->radii.z) + length(half);
        return !from || length(cross(b->center - middle, m_sun)) < reach_of;
    });
    const Box wide{region.min - kCloseReach, region.max + kCloseReach};
    pick(known.close_boxes, out.close_boxes, [&](const Box* b) { return overlaps(wide, *b); });
}

double SceneLight::sunVisibility(const NearOccluders& near, dvec3 position, double blur) const
{
    double visible = 1;
    for (const Box* b : near.sun_boxes) {
        const double depth = rayDepth(*b, position, m_sun);
        if (depth > 0)
            visible = std::min(visible, 1 - smoothstep(0.0, 2.5 * blur + 0.3, depth));
        if (visible <= 0)
            return 0;
    }
    for (const BlobOccluder* b : near.sun_blobs) {
        const dvec3 to = (b->center - position) / b->radii, d = m_sun / b->radii;
        const double along = std::max(0.0, dot(to, d) / dot(d, d));
        const double miss = length(to - d * along);
        const double inside = length(to);
        if (inside > 1.05) // not for points within the crown: its leaves are shaded by their height
            visible = std::min(visible, 0.25 + 0.75 * smoothstep(0.7, 1.1 + 0.3 * blur / b->radii.x, miss));
    }
    return visible;
}

double SceneLight::openness(const NearOccluders& near, dvec3 position, dvec3 normal) const
{
    double open = 1;
    const dvec3 probe = position + normal * 0.3;
    for (const Box* b : near.close_boxes)
        if (boxDistance(*b, position) > kOwnWall)
            open = std::min(open, 0.58 + 0.42 * smoothstep(0.0, kCloseReach, boxDistance(*b, probe)));
    return open;
}

dvec3 SceneLight::roomLight(const NearOccluders& near, dvec3 position, dvec3 normal, double blur) const
{
    const RoomWindow& w = kRoomWindow;
    constexpr int kSide = 3;
    double sky = 0;
    for (int i = 0; i < kSide; ++i)
        for (int j = 0; j < kSide; ++j) {
            const dvec3 light{w.x, lerp(w.y0, w.y1, (i + 0.5) / kSide), lerp(w.z0, w.z1, (j + 0.5) / kSide)};
            const dvec3 to = light - position;
            const double distance2 = dot(to, to) + 0.05, distance = std::sqrt(distance2);
            const dvec3 d = to * (1 / distance);
            const double cosines = std::max(0.0, dot(d, normal)) * std::max(0.0, d.x);
            if (cosines <= 0)
                continue;
            double open = 1;
            for (const Box* b : near.sun_boxes) {
                const double depth = rayDepth(*b, position + normal * 0.02, to);
                if (depth > 0) // in multiples of `to`; from 1 on the box lies behind the window
                    open = std::min(open, 1 - smoothstep(0.0, 0.25, depth));
            }
            sky += open * cosines / distance2;
        }
    const double area = (w.y1 - w.y0) * (w.z1 - w.z0) / (kSide * kSide);
    dvec3 light = dvec3{0.95, 1.0, 1.1} * (2.6 * sky * area);
    // sunlight through the panes
    const dvec3 sun = normalized({0.74, 0.30, 0.62});
    if (dot(sun, normal) > 0) {
        const double along = (w.x - position.x) / sun.x;
        const dvec3 hit = position + sun * along;
        const double soft = 0.04 + blur;
        const auto inside = [&](double x, double a, double b) {
            return smoothstep(a - soft, a + soft, x) * (1 - smoothstep(b - soft, b + soft, x));
        };
        double beam = inside(hit.y, w.y0, w.y1) * inside(hit.z, w.z0, w.z1);
        const double middle = 0.5 * (w.y0 + w.y1);
        beam *= 1 - inside(hit.y, middle - 0.05, middle + 0.05);
        for (const Box* b : near.sun_boxes)
            if (beam > 0 && rayDepth(*b, position + normal * 0.02, sun) > 0.02)
                beam = 0;
        light = light + dvec3{3.4, 2.9, 2.1} * (beam * dot(sun, normal));
    }
    // light from walls and ceiling: warm, less in corners, more on surfaces that face up
    const double corner = std::min({kRoomHalf.x - std::abs(position.x), kRoomHalf.y - std::abs(position.y)});
    const double height = std::min(position.z, kRoomHeight - position.z);
    const double open =
        (0.6 + 0.4 * smoothstep(0.0, 0.8, std::abs(corner))) * (0.75 + 0.25 * smoothstep(0.0, 0.5, height));
    double close = 1;
    for (const Box* b : near.close_boxes)
        if (boxDistance(*b, position) > kOwnWall)
            close = std::min(close, 0.45 + 0.55 * smoothstep(0.0, 0.4, boxDistance(*b, position + normal * 0.06)));
    return light + dvec3{0.80, 0.72, 0.61} * (open * close * (0.9 + 0.1 * normal.z));
}

dvec3 SceneLight::irradiance(const NearOccluders& near, dvec3 position, dvec3 normal, double blur, double wrap) const
{
    if (m_spec.scene == SampleScene::Room)
        return roomLight(near, position, normal, blur);
    const double facing = (dot(normal, m_sun) + wrap) / (1 + wrap);
    const double sun = facing > 0 ? facing * sunVisibility(near, position + normal * 0.05, blur) : 0;
    const double open = openness(near, position, normal);
    const dvec3 sky = kSkyColor * (0.55 + 0.45 * normal.z) + kBounceColor * (0.5 - 0.5 * normal.z);
    return kSunColor * sun + sky * open;
}

dvec3 displayColor(dvec3 linear)
{
    const auto curve = [](double x) { return std::sqrt(std::max(0.0, 1 - std::exp(-1.1 * x))); };
    return {curve(linear.x), curve(linear.y), curve(linear.z)};
}

} // namespace gsc
