// SPDX-License-Identifier: Apache-2.0
#include "runtime/view/stereo.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gsc {

namespace {

constexpr double kLeastCosine = 0.01; // of a border ray with the merged axis: 89.4 degrees
constexpr double kWideCosine = 0.1;   // beyond 84 degrees the tightest axis is worth more than the eyes' own
constexpr double kRounding = 1e-9;    // far above what double precision loses, far below what anyone sees
constexpr double kDegenerate = 1e-12; // shorter vectors have no direction

using Vector = std::array<double, 3>;

Vector operator+(const Vector& a, const Vector& b)
{
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator*(double s, const Vector& a)
{
    return {s * a[0], s * a[1], s * a[2]};
}
double dot(const Vector& a, const Vector& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector cross(const Vector& a, const Vector& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
// Zero if there is no direction.
Vector unit(const Vector& a)
{
    const double length = std::sqrt(dot(a, a));
    return length > kDegenerate ? (1 / length) * a : Vector{};
}

struct Axes {
    Vector right, down, forward; // in the world, orthonormal
};

// A pyramid in the world. `low` and `high`: of x and y at depth 1.
struct Pyramid {
    Axes axes;
    double low[2], high[2];

    // The ray at depth 1 through a place between low (0) and high (1).
    [[nodiscard]] Vector ray(double x, double y) const
    {
        return axes.forward + (low[0] + x * (high[0] - low[0])) * axes.right +
               (low[1] + y * (high[1] - low[1])) * axes.down;
    }
};

using BorderRays = std::array<Vector, 8>;

double leastCosine(const BorderRays& rays, const Vector& axis)
{
    double least = 1;
    for (const Vector& ray : rays)
        least = std::min(least, dot(ray, axis));
    return least;
}

// The axis whose cone over the rays is the narrowest: two or three of them touch it.
Vector narrowestAxis(const BorderRays& rays)
{
    Vector best{};
    double best_cosine = -1;
    const auto consider = [&](const Vector& axis) {
        if (axis != Vector{} && leastCosine(rays, axis) > best_cosine) {
            best_cosine = leastCosine(rays, axis);
            best = axis;
        }
    };
    for (size_t a = 0; a < rays.size(); ++a)
        for (size_t b = a + 1; b < rays.size(); ++b) {
            consider(unit(rays[a] + rays[b]));
            for (size_t c = b + 1; c < rays.size(); ++c) {
                const Vector normal = unit(cross(rays[b] + -1 * rays[a], rays[c] + -1 * rays[a]));
                consider(normal);
                consider(-1 * normal);
            }
        }
    return best;
}

// The pyramid of directions that holds both, or none. Its roll is that between the eyes'.
std::optional<Pyramid> mergedDirections(const Pyramid eyes[2])
{
    BorderRays rays;
    for (size_t i = 0; i < rays.size(); ++i)
        rays[i] = unit(eyes[i / 4].ray(double(i % 2), double(i / 2 % 2)));
    Vector forward = unit(eyes[0].axes.forward + eyes[1].axes.forward);
    if (!(leastCosine(rays, forward) > kWideCosine))
        forward = narrowestAxis(rays);
    if (!(leastCosine(rays, forward) > kLeastCosine))
        return std::nullopt;
    Pyramid merged{};
    const auto across = [&](const Vector& v) { return unit(v + -dot(v, forward) * forward); };
    merged.axes.forward = forward;
    for (const Vector& hint : {eyes[0].axes.right + eyes[1].axes.right, eyes[0].axes.right, eyes[0].axes.down})
        if (merged.axes.right == Vector{})
            merged.axes.right = across(hint);
    merged.axes.right = unit(merged.axes.right);
    merged.axes.down = cross(forward, merged.axes.right);
    for (int axis = 0; axis < 2; ++axis) {
        double low = INFINITY, high = -INFINITY;
        for (const Vector& ray : rays) {
            const double tangent = dot(ray, axis == 0 ? merged.axes.right : merged.axes.down) / dot(ray, forward);
            low = std::min(low, tangent);
            high = std::max(high, tangent);
        }
        merged.low[axis] = low - kRounding * (1 + std::abs(low));
        merged.high[axis] = high + kRounding * (1 + std::abs(high));
    }
    return merged;
}

// Largest depth along the merged axis of an apex whose pyramid holds both points, and where it lies across.
Vector apexOf(const Pyramid& merged, const Vector points[2])
{
    double low_start[2], high_start[2], depth = INFINITY, size = 0;
    for (int axis = 0; axis < 2; ++axis) {
        low_start[axis] = INFINITY; // of an apex at depth 0 the low side must start below this
        high_start[axis] = -INFINITY;
        for (int i = 0; i < 2; ++i) {
            const double across = dot(points[i], axis == 0 ? merged.axes.right : merged.axes.down);
            const double along = dot(points[i], merged.axes.forward);
            low_start[axis] = std::min(low_start[axis], across - merged.low[axis] * along);
            high_start[axis] = std::max(high_start[axis], across - merged.high[axis] * along);
            depth = std::min(depth, along);
            size = std::max({size, std::abs(across), std::abs(along)});
        }
        depth = std::min(depth, (low_start[axis] - high_start[axis]) / (merged.high[axis] - merged.low[axis]));
    }
    depth -= kRounding * size;
    double across[2];
    for (int axis = 0; axis < 2; ++axis)
        across[axis] =
            0.5 * (low_start[axis] + merged.low[axis] * depth + high_start[axis] + merged.high[axis] * depth);
    return across[0] * merged.axes.right + across[1] * merged.axes.down + depth * merged.axes.forward;
}

// Depth along `forward` that a ray of the pyramid gains at least, per unit of the pyramid's own depth.
double leastGain(const Pyramid& eye, const Vector& forward)
{
    double least = INFINITY;
    for (int corner = 0; corner < 4; ++corner)
        least = std::min(least, dot(eye.ray(corner % 2, corner / 2), forward));
    return least;
}

} // namespace

std::optional<MergedView> mergedView(const Camera& left, const Camera& right, double near_z)
{
    const Camera* const cameras[2] = {&left, &right};
    Pyramid eyes[2] = {};
    Vector centers[2];
    double nearest[2];
    for (int i = 0; i < 2; ++i) {
        const Camera& camera = *cameras[i];
        const EyeParams64 eye = eyeParams64(camera, {});
        std::copy_n(eye.center, 3, centers[i].begin());
        const auto row = [&](int r) {
            return Vector{eye.world_to_view[4 * r], eye.world_to_view[4 * r + 1], eye.world_to_view[4 * r + 2]};
        };
        eyes[i] = {{unit(row(0)), unit(row(1)), unit(row(2))},
                   {eye.tan_mid_x - eye.tan_fov_x, eye.tan_mid_y - eye.tan_fov_y},
                   {eye.tan_mid_x + eye.tan_fov_x, eye.tan_mid_y + eye.tan_fov_y}};
        nearest[i] = near_z / std::sqrt(dot(row(2), row(2))); // a transforms file may scale the world
    }
    const std::optional<Pyramid> merged = mergedDirections(eyes);
    if (!merged)
        return std::nullopt;
    const Vector apex = apexOf(*merged, centers);
    MergedView view;
    view.near_z = INFINITY;
    for (int i = 0; i < 2; ++i)
        view.near_z = std::min(view.near_z, dot(centers[i] + -1 * apex, merged->axes.forward) +
                                                nearest[i] * leastGain(eyes[i], merged->axes.forward));
    view.near_z *= 1 - kRounding;
    Camera& camera = view.camera;
    const Vector* const columns[3] = {&merged->axes.right, &merged->axes.down, &merged->axes.forward};
    for (size_t c = 0; c < 3; ++c) {
        for (size_t r = 0; r < 3; ++r)
            camera.rotation[3 * r + c] = (*columns[c])[r];
        camera.translation[c] = -dot(*columns[c], apex);
    }
    camera.fov_x = 2 * std::atan((merged->high[0] - merged->low[0]) / 2);
    camera.fov_y = 2 * std::atan((merged->high[1] - merged->low[1]) / 2);
    camera.tan_mid_x = (merged->low[0] + merged->high[0]) / 2;
    camera.tan_mid_y = (merged->low[1] + merged->high[1]) / 2;
    return view;
}

bool sameDepths(const EyeParams& left, const EyeParams& right)
{
    // each was rounded once, from double; a sum that cancels leaves what doubles leave of its parts
    constexpr float kRounded = 1.3e-7f, kCancelled = 1e-12f;
    const float *l = left.world_to_view + 8, *r = right.world_to_view + 8;
    float parts = 0;
    for (int i = 0; i < 3; ++i)
        parts += std::abs(left.center[i]) + std::abs(right.center[i]);
    const auto same = [](float a, float b, float rest) {
        return std::abs(a - b) <= kRounded * std::max(std::abs(a), std::abs(b)) + rest;
    };
    return same(l[0], r[0], kCancelled) && same(l[1], r[1], kCancelled) && same(l[2], r[2], kCancelled) &&
           same(l[3], r[3], kCancelled * parts);
}

std::optional<EyeBounds> mergedBounds(const EyeParams& left, const EyeParams& right, const RasterConstants& rules)
{
    const EyeParams* const params[2] = {&left, &right};
    Pyramid eyes[2] = {};
    // an anchor of size sigma lies in the pyramid with its apex at center - sigma * back
    Vector centers[2], back[2];
    double setback[2];
    for (int i = 0; i < 2; ++i) {
        const EyeParams& eye = *params[i];
        const EyeBounds bounds = eyeBounds(eye, rules, 0, 0);
        const auto row = [&](int r) {
            const float* w = eye.world_to_view + 4 * r;
            return Vector{double(w[0]), double(w[1]), double(w[2])};
        };
        centers[i] = {double(eye.center[0]), double(eye.center[1]), double(eye.center[2])};
        const double scale = 1 / dot(row(2), row(2)); // the world's length of a view unit, squared
        eyes[i].axes = {scale * row(0), scale * row(1), scale * row(2)};
        const double focal[2] = {double(eye.focal_x), double(eye.focal_y)};
        setback[i] = 0;
        for (int axis = 0; axis < 2; ++axis) {
            double slopes[2]; // focal * across + slope * depth + reach * sigma >= 0, and the other side's
            for (int side = 0; side < 2; ++side) {
                const BoundPlane& plane = bounds.planes[1 + 2 * axis + side];
                slopes[side] = dot({double(plane.n[0]), double(plane.n[1]), double(plane.n[2])}, eyes[i].axes.forward);
            }
            eyes[i].low[axis] = -slopes[0] / focal[axis];
            eyes[i].high[axis] = slopes[1] / focal[axis];
            setback[i] = std::max(setback[i], 2 * double(bounds.planes[1].sigma_factor) / (slopes[0] + slopes[1]));
        }
        back[i] = setback[i] * eyes[i].ray(0.5, 0.5);
    }
    const std::optional<Pyramid> merged = mergedDirections(eyes);
    if (!merged)
        return std::nullopt;
    const Axes& axes = merged->axes;
    const Vector normals[5] = {
        axes.forward, axes.right + -merged->low[0] * axes.forward, merged->high[0] * axes.forward + -1 * axes.right,
        axes.down + -merged->low[1] * axes.forward, merged->high[1] * axes.forward + -1 * axes.down};
    EyeBounds bounds{};
    for (int k = 0; k < 5; ++k) {
        BoundPlane& plane = bounds.planes[k];
        double offset = -INFINITY, sigma_factor = 0;
        for (int i = 0; i < 2; ++i) {
            // the near side moves with the eye's own near plane, which no size moves
            const double gain = k == 0 ? leastGain(eyes[i], axes.forward) : 0;
            offset = std::max(offset, -dot(normals[k], centers[i]) - 0.9999 * double(rules.near_z) * gain);
            sigma_factor = std::max(sigma_factor, dot(normals[k], back[i]) - setback[i] * gain);
        }
        for (size_t c = 0; c < 3; ++c)
            plane.n[c] = float(normals[k][c]);
        plane.offset = float(offset);
        plane.sigma_factor = float(sigma_factor * 1.000001);
    }
    return bounds;
}

} // namespace gsc
