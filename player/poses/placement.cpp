// SPDX-License-Identifier: Apache-2.0
#include "player/poses/placement.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kMostScale = 1000; // most that hands can enlarge or shrink the first scale, as a factor

bool isFinite(const glm::dvec3& v)
{
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Converts between the camera's axes (right, down, forward) and OpenXR's (right, up, backward): y and z change their
// sign.
constexpr double kFlip[3] = {1, -1, -1};

glm::dmat3 flipped(const glm::dmat3& axes)
{
    glm::dmat3 out = axes;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            out[column][row] *= kFlip[column] * kFlip[row];
    return out;
}

glm::dmat3 aboutVertical(double angle)
{
    return glm::mat3_cast(glm::angleAxis(angle, glm::dvec3(0, 1, 0)));
}

} // namespace

Placement::Placement(const Camera& camera, const std::array<double, 3>& up, double metre, double eye_height)
{
    glm::dvec3 world_up = glm::make_vec3(up.data());
    if (!isFinite(world_up) || glm::length(world_up) < 1e-6)
        world_up = {0, -1, 0};
    world_up = glm::normalize(world_up);
    m_scale = m_first_scale = std::isfinite(metre) && metre > 0 ? metre : 1;
    // make_mat3() reads the row-major matrix column by column, so its columns are right, down and forward
    const glm::dmat3 rows = glm::make_mat3(camera.rotation);
    const glm::dvec3 right(rows[0][0], rows[1][0], rows[2][0]), down(rows[0][1], rows[1][1], rows[2][1]),
        forward(rows[0][2], rows[1][2], rows[2][2]);
    const auto level = [&](const glm::dvec3& v) { return v - world_up * glm::dot(v, world_up); };
    glm::dvec3 ahead = level(forward);
    if (glm::length(ahead) < 1e-3)
        ahead = level(-down);
    if (!isFinite(ahead) || glm::length(ahead) < 1e-3)
        ahead = level(std::abs(world_up.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1));
    ahead = glm::normalize(ahead);
    m_axes = glm::dmat3(glm::cross(ahead, world_up), world_up, -ahead);
    const glm::dvec3 t = glm::make_vec3(camera.translation);
    m_origin = -(right * t.x + down * t.y + forward * t.z) - world_up * (eye_height * m_scale);
    if (!isFinite(m_origin))
        m_origin = {};
}

Placement::Placement(const glm::dvec3& origin, const glm::dmat3& axes, double scale)
    : m_origin(origin), m_axes(axes), m_scale(scale), m_first_scale(scale)
{
}

bool Placement::isPlace(const glm::dvec3& origin, const glm::dmat3& axes)
{
    const glm::dmat3 square = glm::transpose(axes) * axes;
    double off = std::abs(glm::determinant(axes) - 1);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            off = std::max(off, std::abs(square[i][j] - (i == j ? 1 : 0)));
    return isFinite(origin) && off < 1e-3;
}

Camera Placement::eye(const SpaceEye& eye, const Camera& lens) const
{
    // the space as a camera; the columns of m_axes are right, up and backward in the world
    Camera head = lens;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            head.rotation[3 * row + column] = m_axes[column][row] * kFlip[column];
    for (int i = 0; i < 3; ++i)
        head.translation[i] = -glm::dot(m_axes[i] * kFlip[i], m_origin);
    EyeView view;
    view.left = eye.left;
    view.right = eye.right;
    view.up = eye.up;
    view.down = eye.down;
    // normalised: a runtime's quaternion has length 1 in single precision only
    const glm::dmat3 turned = flipped(glm::mat3_cast(glm::normalize(eye.pose.rotation)));
    for (int row = 0; row < 3; ++row) {
        view.position[row] = m_scale * eye.pose.position[row] * kFlip[row];
        for (int column = 0; column < 3; ++column)
            view.rotation[3 * row + column] = turned[column][row];
    }
    return eyeOfHead(head, view);
}

void Placement::move(const glm::dvec3& by)
{
    if (isFinite(by))
        m_origin += m_scale * (m_axes * by);
}

void Placement::turn(double angle, const glm::dvec3& about)
{
    if (!std::isfinite(angle) || !isFinite(about))
        return;
    const glm::dvec3 fixed = toWorld(about);
    m_axes = m_axes * aboutVertical(angle);
    m_origin = fixed - m_scale * (m_axes * about);
}

void Placement::drag(const glm::dvec3 (&from)[2], const glm::dvec3 (&to)[2])
{
    const glm::dvec3 before = from[1] - from[0], after = to[1] - to[0];
    const double length = glm::length(before), now = glm::length(after);
    if (!isFinite(before) || !isFinite(after) || length < 1e-3 || now < 1e-3)
        return;
    const glm::dvec3 held = toWorld((from[0] + from[1]) / 2.0);
    // the world turns with the hands, so the space turns the other way about the middle of the hands
    const glm::dvec2 a(before.x, before.z), b(after.x, after.z);
    double angle = 0;
    if (glm::length(a) > 0.01 && glm::length(b) > 0.01) // if one hand is right above the other, they give no direction
        angle = std::atan2(b.x * a.y - b.y * a.x, glm::dot(a, b));
    m_axes = m_axes * aboutVertical(-angle);
    m_scale = std::clamp(m_scale * length / now, m_first_scale / kMostScale, m_first_scale * kMostScale);
    m_origin = held - m_scale * (m_axes * ((to[0] + to[1]) / 2.0));
}

std::array<float, 2> gazeOf(const SpaceEye& eye, const SpacePose& gaze)
{
    const glm::dvec3 along = glm::inverse(eye.pose.rotation) * (gaze.rotation * glm::dvec3(0, 0, -1));
    if (!isFinite(along) || !(-along.z > 0.5 * glm::length(along)))
        return {0, 0};
    return {float(along.x / -along.z), float(along.y / along.z)};
}

std::optional<glm::dvec3> pointOnFloor(const SpacePose& hand, double height, double most)
{
    const glm::dvec3 along = glm::mat3_cast(hand.rotation) * glm::dvec3(0, 0, -1);
    const double drop = hand.position.y - height;
    if (!isFinite(along) || !isFinite(hand.position) || along.y > -1e-3 || drop <= 0)
        return std::nullopt;
    glm::dvec3 to = hand.position + along * (drop / -along.y);
    const glm::dvec3 way(to.x - hand.position.x, 0, to.z - hand.position.z);
    const double length = glm::length(way);
    if (length > most)
        to = hand.position + way * (most / length);
    to.y = height;
    return to;
}

} // namespace gsc
