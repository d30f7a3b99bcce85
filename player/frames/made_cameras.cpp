// SPDX-License-Identifier: Apache-2.0
#include "player/frames/made_cameras.h"

#include <gsc/error.h>
#include "player/poses/pose.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

namespace gsc {

namespace {

using glm::dvec3;

constexpr double kParallel = 1e-6; // sine of an angle between directions below which they count as parallel

dvec3 vectorOf(const std::array<double, 3>& v)
{
    return {v[0], v[1], v[2]};
}

std::array<double, 3> arrayOf(const dvec3& v)
{
    return {v.x, v.y, v.z};
}

// Returns the part of `v` across the unit vector `up`.
dvec3 levelPart(const dvec3& v, const dvec3& up)
{
    return v - dot(v, up) * up;
}

// Returns the point with the least sum of squared distances to the cameras' view axes. None if the axes are so nearly
// parallel that they do not say how far away it is, or if it is not ahead of most cameras.
std::optional<dvec3> agreedPoint(const std::vector<CameraPose>& poses)
{
    glm::dmat3 sum(0);
    dvec3 moment(0);
    for (const CameraPose& pose : poses) {
        const glm::dmat3 across = glm::dmat3(1) - glm::outerProduct(pose.axes[2], pose.axes[2]);
        sum += across;
        moment += across * pose.position;
    }
    const auto count = double(poses.size());
    if (!(determinant(sum) > 1e-3 * count * count * count))
        return std::nullopt;
    const dvec3 point = inverse(sum) * moment;
    const auto ahead = std::ranges::count_if(
        poses, [&](const CameraPose& pose) { return dot(point - pose.position, pose.axes[2]) > 0; });
    if (!(2 * double(ahead) > count))
        return std::nullopt;
    return point;
}

// Pose and lens of a key as numbers that a spline goes through.
struct Knot {
    glm::dvec3 position;
    glm::dquat turn;
    double time = 0; // a place on the way; differences are about even in how much the picture changes
    double lens[4];  // half sizes and middle of the image at depth 1
};

Knot knotOf(const Camera& key)
{
    const CameraPose pose = poseOf(key).value_or(CameraPose{});
    return {pose.position,
            glm::quat_cast(pose.axes),
            0,
            {std::tan(key.fov_x / 2), std::tan(key.fov_y / 2), key.tan_mid_x, key.tan_mid_y}};
}

double angleBetween(const Knot& a, const Knot& b)
{
    return 2 * std::acos(std::min(1.0, std::abs(dot(a.turn, b.turn))));
}

// Sets the knots' times, and the signs of their quaternions so that neighbours turn the shorter way.
std::vector<Knot> knotsOf(std::span<const Camera> keys)
{
    constexpr double kLeastStep = 0.01; // share of a mean step, so that equal keys follow each other in time
    std::vector<Knot> knots;
    double way = 0, turning = 0;
    for (const Camera& key : keys) {
        knots.push_back(knotOf(key));
        if (knots.size() == 1)
            continue;
        const Knot& before = knots[knots.size() - 2];
        if (dot(before.turn, knots.back().turn) < 0)
            knots.back().turn = -knots.back().turn;
        way += distance(before.position, knots.back().position);
        turning += angleBetween(before, knots.back());
    }
    const auto steps = double(knots.size() - 1);
    for (size_t i = 1; i < knots.size(); ++i) {
        const double moved = distance(knots[i - 1].position, knots[i].position);
        const double share = (way > 0 ? moved * steps / way : 0) +
                             (turning > 0 ? angleBetween(knots[i - 1], knots[i]) * steps / turning : 0);
        knots[i].time = knots[i - 1].time + std::max(share, kLeastStep);
    }
    return knots;
}

// Slope of the spline through knot `i` of a value `of` the knots.
template <typename Of>
auto slopeAt(const std::vector<Knot>& knots, size_t i, const Of& of)
{
    const auto rise = [&](size_t a) { return (of(knots[a + 1]) - of(knots[a])) / (knots[a + 1].time - knots[a].time); };
    if (i == 0)
        return rise(0);
    if (i + 1 == knots.size())
        return rise(i - 1);
    const double before = knots[i].time - knots[i - 1].time, behind = knots[i + 1].time - knots[i].time;
    return (rise(i - 1) * behind + rise(i) * before) / (before + behind);
}

// Value of the spline at share `s` of the way from knot `i` to the next.
template <typename Of>
auto splineAt(const std::vector<Knot>& knots, size_t i, double s, const Of& of)
{
    const double step = knots[i + 1].time - knots[i].time;
    const double far = s * s * (3 - 2 * s), left = s * (1 - s) * (1 - s) * step, right = s * s * (s - 1) * step;
    return of(knots[i]) * (1 - far) + of(knots[i + 1]) * far + slopeAt(knots, i, of) * left +
           slopeAt(knots, i + 1, of) * right;
}

// The camera at share `s` of the way from key `i` to the next.
Camera onWay(std::span<const Camera> keys, const std::vector<Knot>& knots, size_t i, double s)
{
    Camera camera = s < 1 ? keys[i] : keys[i + 1];
    if (!(s > 0 && s < 1))
        return camera;
    const dvec3 position = splineAt(knots, i, s, [](const Knot& knot) { return knot.position; });
    const glm::dquat turn = splineAt(knots, i, s, [](const Knot& knot) { return knot.turn; });
    setPose({position, orthonormal(glm::mat3_cast(normalize(turn)))}, camera);
    double lens[4];
    for (int k = 0; k < 4; ++k)
        lens[k] = std::lerp(knots[i].lens[k], knots[i + 1].lens[k], s);
    camera.fov_x = 2 * std::atan(lens[0]);
    camera.fov_y = 2 * std::atan(lens[1]);
    camera.tan_mid_x = lens[2];
    camera.tan_mid_y = lens[3];
    return camera;
}

// Returns true if `a` stands before `b`; runs of digits compare as numbers.
bool namedBefore(const std::string& a, const std::string& b)
{
    const auto digitsEnd = [](const std::string& text, size_t at) {
        while (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at])) != 0)
            ++at;
        return at;
    };
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        const size_t i_end = digitsEnd(a, i), j_end = digitsEnd(b, j);
        if (i_end == i || j_end == j) {
            if (a[i] != b[j])
                return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        const auto number = [](const std::string& text, size_t from, size_t end) {
            from = std::min(text.find_first_not_of('0', from), end);
            return text.substr(from, end - from);
        };
        const std::string left = number(a, i, i_end), right = number(b, j, j_end);
        if (left != right)
            return left.size() != right.size() ? left.size() < right.size() : left < right;
        i = i_end, j = j_end;
    }
    return a.size() - i < b.size() - j;
}

} // namespace

bool hasDirection(const Sight& sight)
{
    double most = 0;
    for (int i = 0; i < 3; ++i)
        most = std::max({most, std::abs(sight.position[i]), std::abs(sight.target[i])});
    return distance(vectorOf(sight.position), vectorOf(sight.target)) > 1e-12 * most;
}

Camera cameraAt(const Sight& sight, const std::array<double, 3>& up, const Camera& lens)
{
    const dvec3 position = vectorOf(sight.position), above = vectorOf(up);
    const dvec3 forward = normalize(vectorOf(sight.target) - position);
    const CameraPose own = poseOf(lens).value_or(CameraPose{});
    const double way = dot(forward, above) > 0 ? -1 : 1;
    // directions of the picture's upper edge: the first one that is not the view's own
    for (const dvec3& top : {above, way * own.axes[2], -own.axes[1], own.axes[0]}) {
        const dvec3 right = cross(forward, top);
        if (!(length(right) > kParallel))
            continue;
        Camera camera = lens;
        setPose({position, orthonormal({right, cross(forward, right), forward})}, camera);
        return camera;
    }
    return lens; // not reached: an axis of `own` lies across the view
}

Sight turntableSight(std::span<const Camera> cameras, const std::array<double, 3>& up, const std::array<double, 3>& low,
                     const std::array<double, 3>& high)
{
    constexpr double kSteepest = 60 * std::numbers::pi / 180, kFromAbove = 30 * std::numbers::pi / 180;
    const dvec3 above = vectorOf(up);
    std::vector<CameraPose> poses;
    for (const Camera& camera : cameras)
        if (const std::optional<CameraPose> pose = poseOf(camera))
            poses.push_back(*pose);
    if (const std::optional<dvec3> target = poses.empty() ? std::nullopt : agreedPoint(poses)) {
        double height = 0, radius = 0;
        dvec3 side(0); // direction from the target of the first camera that does not stand above it
        for (const CameraPose& pose : poses) {
            const dvec3 away = pose.position - *target, level = levelPart(away, above);
            height += dot(away, above) / double(poses.size());
            radius += length(level) / double(poses.size());
            if (side == dvec3(0) && length(level) > kParallel * length(away))
                side = normalize(level);
        }
        radius = std::max(radius, height / std::tan(kSteepest));
        if (side != dvec3(0) && radius > 0)
            return {arrayOf(*target + radius * side + height * above), arrayOf(*target)};
    }
    const dvec3 middle = (vectorOf(low) + vectorOf(high)) / 2.0;
    const double away = std::max(length(vectorOf(high) - vectorOf(low)), 1e-6);
    const dvec3 across = std::abs(above.z) < 0.9 ? dvec3(0, 0, -1) : dvec3(0, -1, 0);
    const dvec3 side = normalize(levelPart(across, above));
    return {arrayOf(middle + away * (std::cos(kFromAbove) * side + std::sin(kFromAbove) * above)), arrayOf(middle)};
}

double widestGap(std::span<const Camera> cameras, const Sight& sight, const std::array<double, 3>& up)
{
    const dvec3 above = vectorOf(up), target = vectorOf(sight.target);
    const dvec3 ahead = levelPart(vectorOf(sight.position) - target, above), left = cross(above, ahead);
    std::vector<double> angles;
    for (const Camera& camera : cameras)
        if (const std::optional<CameraPose> pose = poseOf(camera))
            angles.push_back(std::atan2(dot(pose->position - target, left), dot(pose->position - target, ahead)));
    std::ranges::sort(angles);
    double widest = angles.empty() ? 0 : angles.front() + 2 * std::numbers::pi - angles.back();
    for (size_t i = 1; i < angles.size(); ++i)
        widest = std::max(widest, angles[i] - angles[i - 1]);
    return widest;
}

std::vector<Camera> turntable(const Sight& sight, const std::array<double, 3>& up, const Camera& lens, size_t frames)
{
    const dvec3 above = vectorOf(up), target = vectorOf(sight.target);
    const dvec3 away = vectorOf(sight.position) - target;
    std::vector<Camera> cameras;
    for (size_t i = 0; i < frames; ++i) {
        const double angle = 2 * std::numbers::pi * double(i) / double(frames);
        const dvec3 turned = glm::angleAxis(angle, above) * away;
        cameras.push_back(cameraAt({arrayOf(target + turned), sight.target}, up, lens));
        cameras.back().name = formatString("%04zu", i);
    }
    return cameras;
}

std::vector<Camera> wayThrough(std::span<const Camera> keys, size_t frames)
{
    const std::vector<Knot> knots = knotsOf(keys);
    std::vector<Camera> cameras;
    size_t key = 0;
    for (size_t i = 0; i < frames; ++i) {
        const double time = knots.back().time * double(i) / double(frames - 1);
        while (key + 2 < knots.size() && time >= knots[key + 1].time)
            ++key;
        const double share = i + 1 == frames ? 1 : (time - knots[key].time) / (knots[key + 1].time - knots[key].time);
        cameras.push_back(onWay(keys, knots, key, share));
        Camera& camera = cameras.back();
        camera.name = formatString("%04zu", i);
        camera.width = keys.front().width;
        camera.height = keys.front().height;
        camera.appearance = keys.front().appearance;
    }
    return cameras;
}

void sortByName(std::vector<Camera>& cameras)
{
    std::ranges::stable_sort(cameras, [](const Camera& a, const Camera& b) { return namedBefore(a.name, b.name); });
}

} // namespace gsc
