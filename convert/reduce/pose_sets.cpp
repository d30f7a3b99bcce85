// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/pose_sets.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gsc {

namespace {

using Quaternion = std::array<double, 4>; // w, x, y, z

// Of a rotation, row-major.
Quaternion quaternionOf(const double* r)
{
    const double trace = r[0] + r[4] + r[8];
    Quaternion q;
    if (trace > 0) {
        const double s = 2 * std::sqrt(trace + 1);
        q = {s / 4, (r[7] - r[5]) / s, (r[2] - r[6]) / s, (r[3] - r[1]) / s};
    } else {
        const int i = r[0] > r[4] && r[0] > r[8] ? 0 : r[4] > r[8] ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
        const double s = 2 * std::sqrt(std::max(1e-30, 1 + r[4 * i] - r[4 * j] - r[4 * k]));
        q[0] = (r[3 * k + j] - r[3 * j + k]) / s;
        q[size_t(i) + 1] = s / 4;
        q[size_t(j) + 1] = (r[3 * j + i] + r[3 * i + j]) / s;
        q[size_t(k) + 1] = (r[3 * k + i] + r[3 * i + k]) / s;
    }
    return q;
}

void rotationOf(Quaternion q, double* r)
{
    double norm = 0;
    for (const double v : q)
        norm += v * v;
    for (double& v : q)
        v /= std::sqrt(norm);
    const auto [w, x, y, z] = q;
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    std::copy_n(m, 9, r);
}

std::array<double, 3> positionOf(const Camera& c) // -R t
{
    std::array<double, 3> p{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
            p[i] -= c.rotation[3 * i + j] * c.translation[j];
    return p;
}

double distance(const Camera& a, const Camera& b)
{
    const auto p = positionOf(a), q = positionOf(b);
    return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

double cosineBetween(const Camera& a, const Camera& b) // of where they look
{
    double cosine = 0;
    for (int i = 0; i < 3; ++i)
        cosine += a.rotation[3 * i + 2] * b.rotation[3 * i + 2];
    return cosine;
}

// Whether what lies between is likely a pose of the same walk: no more than a turn of 30 degrees, and no jump.
bool lookAlike(const Camera& a, const Camera& b, double usual_step)
{
    return cosineBetween(a, b) > std::cos(0.5236) && distance(a, b) <= 2 * usual_step;
}

// Of the cameras with even numbers, the one whose view is most like that of camera `of`.
const Camera& nearestEven(const std::vector<Camera>& cameras, size_t of, double usual_step)
{
    size_t best = 0;
    double least = INFINITY;
    for (size_t i = 0; i < cameras.size(); i += 2) {
        const double apart = distance(cameras[i], cameras[of]) / std::max(usual_step, 1e-30) +
                             4 * (1 - cosineBetween(cameras[i], cameras[of]));
        if (apart < least) {
            least = apart;
            best = i;
        }
    }
    return cameras[best];
}

void thin(std::vector<Camera>& cameras, size_t most)
{
    if (cameras.size() <= most)
        return;
    std::vector<Camera> kept;
    for (size_t i = 0; i < most; ++i)
        kept.push_back(cameras[i * cameras.size() / most]);
    cameras = std::move(kept);
}

void shrink(Camera& camera, uint32_t most_pixels)
{
    const double pixels = double(camera.width) * camera.height;
    if (pixels <= most_pixels)
        return;
    const double scale = std::sqrt(most_pixels / pixels);
    camera.width = std::max(1u, uint32_t(std::lround(camera.width * scale)));
    camera.height = std::max(1u, uint32_t(std::lround(camera.height * scale)));
}

} // namespace

Camera betweenCameras(const Camera& from, const Camera& to, double share)
{
    Camera result = from;
    result.name = from.name + "+" + to.name;
    Quaternion p = quaternionOf(from.rotation);
    const Quaternion q = quaternionOf(to.rotation);
    double dot = 0;
    for (size_t i = 0; i < 4; ++i)
        dot += p[i] * q[i];
    for (size_t i = 0; i < 4; ++i) // near enough to turning evenly
        p[i] = (1 - share) * p[i] + (dot < 0 ? -share : share) * q[i];
    rotationOf(p, result.rotation);
    const auto a = positionOf(from), b = positionOf(to);
    for (size_t i = 0; i < 3; ++i) {
        result.translation[i] = 0;
        for (size_t j = 0; j < 3; ++j)
            result.translation[i] -= result.rotation[3 * j + i] * ((1 - share) * a[j] + share * b[j]);
    }
    return result;
}

PoseSets splitPoses(std::vector<Camera> cameras, const PoseLimits& limits)
{
    std::ranges::stable_sort(cameras, {}, &Camera::name);
    for (Camera& camera : cameras)
        shrink(camera, limits.most_pixels);
    std::vector<double> steps;
    for (size_t i = 1; i < cameras.size(); ++i)
        steps.push_back(distance(cameras[i - 1], cameras[i]));
    std::ranges::nth_element(steps, steps.begin() + ptrdiff_t(steps.size() / 2));
    const double usual = steps[steps.size() / 2];

    PoseSets sets;
    std::vector<Camera> weights_between, search_between, verdict_between;
    for (size_t i = 0; i < cameras.size(); ++i) {
        (i % 2 == 0 ? sets.weights : i % 4 == 1 ? sets.search : sets.verdict).push_back(cameras[i]);
        if (i % 2 == 0)
            continue;
        weights_between.push_back(betweenCameras(nearestEven(cameras, i, usual), cameras[i], 0.6));
        if (i + 1 < cameras.size() && lookAlike(cameras[i], cameras[i + 1], usual))
            (i % 4 == 1 ? search_between : verdict_between).push_back(betweenCameras(cameras[i], cameras[i + 1], 0.5));
    }
    // as many of the cameras themselves as there is room for, then of the others
    const auto join = [](std::vector<Camera>& set, std::vector<Camera>& between, size_t most) {
        const size_t room = most - std::min(most, set.size());
        thin(between, std::max(room, most / 2));
        thin(set, most - std::min(most / 2, between.size()));
        set.insert(set.end(), between.begin(), between.end());
    };
    join(sets.weights, weights_between, limits.weights);
    join(sets.search, search_between, limits.search);
    join(sets.verdict, verdict_between, limits.verdict);
    return sets;
}

} // namespace gsc
