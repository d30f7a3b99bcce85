// SPDX-License-Identifier: Apache-2.0
// A camera that a person moves: by keys, mouse and gamepad in, a pose out. Knows no window and no clock.
// Axes are COLMAP's, as everywhere: right, down, forward; lengths are world units, angles radians.
#pragma once

#include "player/poses/pose.h"
#include <gsc/camera.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace gsc {

enum class NavigationMode {
    Fly,   // moves along right and forward of the view and along the world's up
    Orbit, // turns about a point ahead
    Walk,  // Fly at constant height
};

// Input of a person during one step. A value that is not finite counts as 0, one that is too large as the limit.
struct NavigationInput {
    double seconds = 0;         // length of the step
    double move[3] = {};        // right, up, forward, each -1..1; together no faster than one alone
    double look_pixels[2] = {}; // drag of the picture, right and down: the point under the cursor follows it
    double look_rate[2] = {};   // stick, -1..1: the view turns right and down, by 90 degrees a second at most
    double pan_pixels[2] = {};  // drag of the picture, right and down; Orbit only
    double scroll = 0;          // notches: faster in Fly and Walk, nearer in Orbit
    bool fast = false;          // 4 times the speed
    bool slow = false;          // a quarter of it
    // Size of the dragged picture: height in pixels, whole angle. Where they make no sense: 1080 and a right angle.
    uint32_t height = 0;
    double fov_y = 0;
};

struct NavigationWorld {
    double up[3] = {0, -1, 0};        // unit vector
    double metre = 0;                 // world units, 0 = unknown: speeds then follow from the size of the scene
    double low[3] = {}, high[3] = {}; // bounds of the scene
};

// Whatever the input, position and axes are finite and the position is at most 1e6 diagonals of the scene from its
// middle. Steps of constant input add up: N of t/N end where one of t does, to within rounding. The drags and notches of
// a step count as spread evenly over it.
class Navigator {
public:
    // Looks at the whole scene from outside, 30 degrees down. A world that makes no sense is mended: up becomes
    // (0, -1, 0), the metre unknown, the scene one unit large.
    explicit Navigator(const NavigationWorld& world);

    [[nodiscard]] NavigationMode mode() const { return m_mode; }
    void setMode(NavigationMode mode) { m_mode = mode; }

    // World units per second at full `move`, without fast and slow. Fly: 5 metres, or a twentieth of the scene's
    // diagonal; Walk: 1.4 metres, or 0.28 of that; from a thousandth to a thousand times as much. Orbit: half the
    // distance.
    [[nodiscard]] double speed() const;
    // Sets the speed of Fly or Walk, whichever is on. Ignored in Orbit and where `speed` is not above 0.
    void setSpeed(double speed);

    // World units to the point that Orbit turns about, straight ahead.
    [[nodiscard]] double distance() const { return m_distance; }
    // Tells the depth of a point that a person points at, 1e-6 to 1000 diagonals of the scene.
    void setDistance(double distance);
    [[nodiscard]] std::array<double, 3> target() const;
    [[nodiscard]] std::array<double, 3> position() const;

    // Returns whether the pose changed. Any move, turn, pan or scroll ends a flight of animateTo() where it is. Turns are
    // about the world's up and about the camera's own right, which keeps its roll; up and down end at 89 degrees. A
    // camera that was put beyond them can only come back.
    bool step(const NavigationInput& input);

    // Puts the camera where `camera` is, with its roll. Until the next change camera() gives that pose bit for bit, if
    // its rotation is one. Ignored where it is not finite.
    void jumpTo(const Camera& camera);
    // As jumpTo(), in `seconds` of steps, slow at both ends: a straight way, an even turn. At once if not above 0.
    void animateTo(const Camera& camera, double seconds);
    [[nodiscard]] bool moves() const { return m_flight.has_value(); } // animateTo() is under way
    // Turns about the forward axis until right is level; looking straight up or down it already is.
    void level();

    // `lens` at the pose: its name, angles, middle, size and appearance.
    [[nodiscard]] Camera camera(const Camera& lens) const;

private:
    struct Wish;     // a checked input
    struct Velocity; // speed, and the turns that change it

    struct Flight {
        CameraPose from, to;
        Camera goal;
        double seconds = 0, elapsed = 0;
    };
    struct GivenPose {
        double rotation[9], translation[3]; // as in Camera
    };

    [[nodiscard]] Wish wishOf(const NavigationInput& input) const;
    void follow(const Wish& wish);
    void advance(Flight& flight, double seconds);
    [[nodiscard]] Velocity velocityOf(const Wish& wish) const;
    [[nodiscard]] glm::dvec3 way(const Velocity& velocity, double yaw, double pitch, double growth) const;
    void turn(double yaw, double pitch);
    [[nodiscard]] double pitchAngle() const;
    void setPosition(glm::dvec3 position);
    [[nodiscard]] size_t gait() const { return m_mode == NavigationMode::Walk; } // index of m_speed

    glm::dvec3 m_up{}, m_plane[2]; // right-handed: plane 0, plane 1, up
    glm::dvec3 m_middle{};
    double m_diagonal = 1;
    double m_default_speed[2] = {}, m_speed[2] = {}; // fly, walk
    NavigationMode m_mode = NavigationMode::Fly;
    CameraPose m_pose;
    double m_distance = 1;
    std::optional<GivenPose> m_given; // m_pose in the exact bits of the camera jumped to
    std::optional<Flight> m_flight;
};

} // namespace gsc
