// SPDX-License-Identifier: Apache-2.0
// Places a headset's space in the world of a model, and moves it by the hands. A space has OpenXR's axes (x right, y
// up, z backward) and metres; the world has the model's axes and units. This code needs no headset.
#pragma once

#include <gsc/camera.h>

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <optional>

namespace gsc {

// Pose of an eye, a head or a hand in a headset's space.
struct SpacePose {
    glm::dvec3 position{};                   // position in the headset's space, metres
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0}; // rotation from the pose's axes to the space's axes, a unit quaternion
};

// An eye as the headset's runtime states it (XrView).
struct SpaceEye {
    SpacePose pose;
    // angles of view in radians (XrFovf); left and down are below zero for most lenses
    double left = 0, right = 0, up = 0, down = 0;
};

// Returns true if both eyes have the same angles of view. Their poses are ignored.
inline bool sameLens(const SpaceEye& a, const SpaceEye& b)
{
    return a.left == b.left && a.right == b.right && a.up == b.up && a.down == b.down;
}

// Place of the space in the world: world = origin + scale * axes * space. The space's y axis is the world's up; hands
// turn the space about that axis alone, so that the horizon stays level.
class Placement {
public:
    // Puts the space's origin `eye_height` metres below `camera` along the world's up. The space faces where the
    // camera looks, made level; if the camera looks straight up or down, its own up counts as forward. `metre` is the
    // number of world units in a metre. Values that make no sense are replaced: `up` by (0, -1, 0), `metre` by 1.
    Placement(const Camera& camera, const std::array<double, 3>& up, double metre, double eye_height);
    // Makes a placement from stored values: the space's origin in the world, the space's axes as columns, and the
    // scale. Precondition: isPlace(), scale > 0.
    Placement(const glm::dvec3& origin, const glm::dmat3& axes, double scale);
    // Returns true if all numbers are finite and `axes` is a rotation to within 1e-3.
    static bool isPlace(const glm::dvec3& origin, const glm::dmat3& axes);

    [[nodiscard]] const glm::dvec3& origin() const { return m_origin; }
    [[nodiscard]] const glm::dmat3& axes() const { return m_axes; }
    [[nodiscard]] double scale() const { return m_scale; } // world units in a metre of the space

    [[nodiscard]] glm::dvec3 toWorld(const glm::dvec3& point) const { return m_origin + m_scale * (m_axes * point); }

    // Camera of an eye: place and angles of view come from `eye`; name, size and appearance from `lens`.
    [[nodiscard]] Camera eye(const SpaceEye& eye, const Camera& lens) const;

    // Lengths in the functions below are metres of the space, angles are radians. Arguments that are not finite change
    // nothing.
    void move(const glm::dvec3& by); // moves the viewer by a vector in the space
    // turns the viewer to the left, about a vertical axis through `about`
    void turn(double angle, const glm::dvec3& about);
    // Moves the world with one hand that holds it and went from `from` to `to`.
    void drag(const glm::dvec3& from, const glm::dvec3& to) { move(from - to); }
    // Moves the world with two hands that hold it: it follows their middle, their direction as seen from above, and
    // their distance. The scale stays between a thousandth and a thousand times the first one.
    void drag(const glm::dvec3 (&from)[2], const glm::dvec3 (&to)[2]);

private:
    glm::dvec3 m_origin{};
    glm::dmat3 m_axes{1.0};
    double m_scale = 1, m_first_scale = 1;
};

// Direction of `gaze` in an eye's view: right and down at depth 1. Exact for far points, since the eyes' distance is
// ignored. Returns 0, 0 if the gaze is more than 60 degrees off the view's axis.
std::array<float, 2> gazeOf(const SpaceEye& eye, const SpacePose& gaze);

// Point where the ray from `hand` along its forward axis meets the horizontal plane at `height`. Seen from above it is
// at most `most` metres from the hand. None if the ray does not point down.
std::optional<glm::dvec3> pointOnFloor(const SpacePose& hand, double height, double most);

} // namespace gsc
