// SPDX-License-Identifier: Apache-2.0
// Placement of a headset's space in the world of a model, and how hands move it. Knows no headset. A space has OpenXR's
// axes (x right, y up, z backward) and metres; the world has the model's axes and units.
#pragma once

#include <gsc/camera.h>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <optional>

namespace gsc {

// A pose in a space: of an eye, a head or a hand.
struct SpacePose {
    glm::dvec3 position{};                   // metres
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // from the pose's axes to the space's, a unit quaternion
};

// An eye as a headset tells it: XrView.
struct SpaceEye {
    SpacePose pose;
    double left = 0, right = 0, up = 0, down = 0; // XrFovf: radians, left and down below zero for most lenses
};

// True if both eyes have the same angles of view. Poses are ignored.
inline bool sameLens(const SpaceEye& a, const SpaceEye& b)
{
    return a.left == b.left && a.right == b.right && a.up == b.up && a.down == b.down;
}

// World = origin + scale * axes * space. The space's y is the world's up; hands turn it about that axis alone, so that the
// horizon stays level.
class Placement {
public:
    // The space's origin, `eye_height` metres below `camera` along the world's up, looks where the camera does, level.
    // `metre`: world units. Where the camera looks straight up or down, its own up counts as forward. Values that
    // make no sense are mended: up becomes (0, -1, 0), the metre 1.
    Placement(const Camera& camera, const std::array<double, 3>& up, double metre, double eye_height);
    // Placement from stored values: origin in the world, columns of axes and the scale. Precondition: isPlace(), scale
    // > 0.
    Placement(const glm::dvec3& origin, const glm::dmat3& axes, double scale);
    // Finite, and a rotation to within 1e-3.
    static bool isPlace(const glm::dvec3& origin, const glm::dmat3& axes);

    [[nodiscard]] const glm::dvec3& origin() const { return m_origin; }
    [[nodiscard]] const glm::dmat3& axes() const { return m_axes; }
    [[nodiscard]] double scale() const { return m_scale; } // world units in a metre of the space

    [[nodiscard]] glm::dvec3 toWorld(const glm::dvec3& point) const { return m_origin + m_scale * (m_axes * point); }

    // `lens` as the eye sees it: its place and angles are the eye's; name, size and appearance the lens's.
    [[nodiscard]] Camera eye(const SpaceEye& eye, const Camera& lens) const;

    // All lengths are metres of the space, angles radians; arguments that are not finite change nothing.
    void move(const glm::dvec3& by);                  // the viewer goes there
    void turn(double angle, const glm::dvec3& about); // the viewer turns to the left, about a vertical axis
    // Moves by one hand that holds the world and went from `from` to `to`.
    void drag(const glm::dvec3& from, const glm::dvec3& to) { move(from - to); }
    // Moves by two hands: the world follows their middle, their direction seen from above, and their distance. The
    // scale stays between a thousandth and a thousand times the first one.
    void drag(const glm::dvec3 (&from)[2], const glm::dvec3 (&to)[2]);

private:
    glm::dvec3 m_origin{};
    glm::dmat3 m_axes{1.0};
    double m_scale = 1, m_first_scale = 1;
};

// Direction of `gaze` in an eye's view, right and down at depth 1, for far points, at which all eyes look about the
// same way. 0, 0 if it is more than 60 degrees off the axis.
std::array<float, 2> gazeOf(const SpaceEye& eye, const SpacePose& gaze);

// Point where a ray from `hand` along its forward axis meets the plane at that height; at most `most` metres away from
// the hand seen from above. None if it does not point down.
std::optional<glm::dvec3> pointOnFloor(const SpacePose& hand, double height, double most);

} // namespace gsc
