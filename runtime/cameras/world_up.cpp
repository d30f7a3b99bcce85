// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/world_up.h"

#include "runtime/cameras/principal_axes.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <vector>

namespace gsc {

namespace {

// shortest mean of the up axes that is trusted; some hundred random directions have a shorter one
constexpr double kLeastAgreement = 0.1;
// least mean square of the right axes along their second direction, which is some 6 degrees of turning
constexpr double kLeastTurn = 0.01;

// Returns column c of a camera's rotation as a unit vector; not finite if the column has no length.
glm::dvec3 axisOf(const Camera& camera, int c)
{
    const double* const r = camera.rotation;
    return glm::normalize(glm::dvec3(r[c], r[3 + c], r[6 + c]));
}

bool isFinite(const glm::dvec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

} // namespace

std::optional<glm::dvec3> upOfViews(std::span<const ViewAxes> views)
{
    glm::dmat3 m(0);
    glm::dvec3 sky(0);
    for (const ViewAxes& view : views) {
        m += glm::outerProduct(view.right, view.right);
        // direction in which the sky lies: above the picture, or behind a camera that looks down
        sky -= view.down + view.forward;
    }
    const auto [axes, values] = principalAxes(m);
    if (!(values[2] < 0.5 * values[1] && values[1] >= kLeastTurn * double(views.size())))
        return std::nullopt;
    return axes[2] * (glm::dot(sky, axes[2]) >= 0 ? 1.0 : -1.0);
}

std::array<double, 3> worldUp(std::span<const Camera> cameras)
{
    std::vector<ViewAxes> views;
    glm::dvec3 sum(0);
    for (const Camera& camera : cameras) {
        const ViewAxes view = {axisOf(camera, 0), axisOf(camera, 1), axisOf(camera, 2)};
        if (!isFinite(view.right) || !isFinite(view.down) || !isFinite(view.forward))
            continue;
        views.push_back(view);
        sum -= view.down;
    }
    if (const std::optional<glm::dvec3> up = upOfViews(views))
        return {up->x, up->y, up->z};
    const double length = glm::length(sum);
    if (views.empty() || length < kLeastAgreement * double(views.size()))
        return {0, -1, 0};
    return {sum.x / length, sum.y / length, sum.z / length};
}

} // namespace gsc
