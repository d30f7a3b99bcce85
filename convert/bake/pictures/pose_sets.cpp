// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/pictures/pose_sets.h"

#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/scene_cameras.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace gsc {

namespace {

glm::dmat3 rotationOf(const Camera& camera)
{
    return transpose(glm::make_mat3(camera.rotation)); // stored by rows
}

glm::dvec3 positionOf(const Camera& camera)
{
    return -(rotationOf(camera) * glm::make_vec3(camera.translation));
}

double distance(const Camera& a, const Camera& b)
{
    return glm::distance(positionOf(a), positionOf(b));
}

double cosineBetween(const Camera& a, const Camera& b) // cosine of the angle between their axes
{
    double cosine = 0;
    for (int i = 0; i < 3; ++i)
        cosine += a.rotation[3 * i + 2] * b.rotation[3 * i + 2];
    return cosine;
}

// True if poses between two cameras are likely on the same walk: a turn of 30 degrees at most, and no jump.
bool lookAlike(const Camera& a, const Camera& b, double usual_step)
{
    return cosineBetween(a, b) > std::cos(0.5236) && distance(a, b) <= 2 * usual_step;
}

// The camera with an even index whose view is most like the view of camera `of`.
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

void leaveOutRepeats(std::vector<Camera>& cameras)
{
    std::set<std::array<double, 12>> poses;
    std::erase_if(cameras, [&](const Camera& camera) {
        std::array<double, 12> pose{};
        std::copy_n(camera.rotation, 9, pose.begin());
        std::copy_n(camera.translation, 3, pose.begin() + 9);
        return !poses.insert(pose).second;
    });
}

Camera betweenCameras(const Camera& from, const Camera& to, double share)
{
    Camera result = from;
    result.name = from.name + "+" + to.name;
    const glm::dquat turned = glm::slerp(glm::quat_cast(rotationOf(from)), glm::quat_cast(rotationOf(to)), share);
    const glm::dmat3 rows = transpose(glm::mat3_cast(glm::normalize(turned)));
    std::copy_n(glm::value_ptr(rows), 9, result.rotation);
    const glm::dvec3 position = glm::mix(positionOf(from), positionOf(to), share);
    translationFromPosition(result.rotation, glm::value_ptr(position), result.translation);
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
    // as many of the cameras themselves as the limit allows, then poses between cameras
    const auto join = [](std::vector<Camera>& set, std::vector<Camera>& between, size_t most) {
        const size_t room = most - std::min(most, set.size());
        between = takeEvenly(std::move(between), std::max(room, most / 2));
        set = takeEvenly(std::move(set), most - std::min(most / 2, between.size()));
        set.insert(set.end(), between.begin(), between.end());
    };
    join(sets.weights, weights_between, limits.weights);
    join(sets.search, search_between, limits.search);
    join(sets.verdict, verdict_between, limits.verdict);
    return sets;
}

} // namespace gsc
