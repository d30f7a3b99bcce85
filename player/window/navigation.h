// SPDX-License-Identifier: Apache-2.0
// A camera that a person moves: takes the input of keys, mouse and gamepad and gives a pose. Needs no window and no
// clock. Axes are COLMAP's, as everywhere (right, down, forward); lengths are world units, angles radians.
#pragma once

#include "player/poses/pose.h"
#include <gsc/camera.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace gsc {

enum class NavigationMode {
    Fly,   // flies along the view's right and forward and the world's up
    Orbit, // turns about a point ahead of the camera
    Walk,  // moves as Fly does, but at constant height
};

// Input of a person during one step. A value that is not finite counts as 0, one beyond its limit as the limit.
struct NavigationInput {
    double seconds = 0;  // length of the step in seconds
    double move[3] = {}; // to the right, up and forward, each -1 to 1; several together are no faster than one
    // drag of the picture to the right and down, pixels: the point under the cursor follows the cursor
    double look_pixels[2] = {};
    double look_rate[2] = {}; // stick, -1 to 1: turns the view right and down, at most by 90 degrees per second
    // drag of the picture to the right and down, pixels; moves the point that Orbit turns about
    double pan_pixels[2] = {};
    double scroll = 0; // notches of the wheel: faster in Fly and Walk, nearer in Orbit
    bool fast = false; // moves at 4 times the speed
    bool slow = false; // moves at a quarter of the speed
    // Size of the dragged picture: height in pixels, vertical angle of view. Values that make no sense count as 1080
    // and a right angle.
    uint32_t height = 0;
    double fov_y = 0;
};

struct NavigationWorld {
    double up[3] = {0, -1, 0};        // direction up in the world, a unit vector
    double metre = 0;                 // world units in a metre, 0 = unknown: the size of the scene then sets the speeds
    double low[3] = {}, high[3] = {}; // lower and upper corner of a box round the scene, world units
};

// For any input, position and axes stay finite and the position at most 1e6 diagonals of the scene from its middle.
// Steps of constant input add up: N steps of t/N seconds end where one of t does, up to rounding. Drags and notches
// count as spread evenly over their step.
class Navigator {
public:
    // Begins with a view of the whole scene from outside, 30 degrees down. Values of `world` that make no sense are
    // replaced: `up` by (0, -1, 0), the metre by unknown, the scene by one of size 1.
    explicit Navigator(const NavigationWorld& world);

    [[nodiscard]] NavigationMode mode() const { return m_mode; }
    void setMode(NavigationMode mode) { m_mode = mode; }

    // Speed in world units per second at full `move`, without fast and slow. Default for Fly: 5 metres per second, or
    // a twentieth of the scene's diagonal if the metre is unknown; for Walk: 1.4 metres, or 0.28 times Fly's; for
    // Orbit: half the distance to the target. Scrolling changes Fly and Walk by up to a factor of 1000.
    [[nodiscard]] double speed() const;
    // Sets the speed of Fly or Walk, whichever is on. Ignored in Orbit, and if `speed` is not above 0.
    void setSpeed(double speed);
    // Sets Fly's default speed, limited to a 2000th and half of the scene's diagonal a second; what scrolling changed
    // is kept as a factor. Ignored if `speed` is not above 0.
    void setUsualSpeed(double speed);

    // Distance in world units to the point that Orbit turns about, straight ahead.
    [[nodiscard]] double distance() const { return m_distance; }
    // Sets the distance to the point that Orbit turns about, limited to 1e-6 to 1000 diagonals of the scene.
    void setDistance(double distance);
    [[nodiscard]] std::array<double, 3> target() const;
    [[nodiscard]] std::array<double, 3> position() const;

    // Moves the camera by one step and returns true if the pose changed. A move, turn, pan or scroll ends a flight of
    // animateTo() where it is. Turns are about the world's up and about the camera's own right axis, which keeps the
    // roll. Pitch ends at 89 degrees up or down; a camera that was set beyond can only come back.
    bool step(const NavigationInput& input);

    // Puts the camera at the pose of `camera`, with its roll. camera() then returns that pose bit for bit until the
    // next change, if its rotation is orthonormal. Ignored if the pose is not finite.
    void jumpTo(const Camera& camera);
    // Flies to the pose of `camera` during the next steps, for `seconds` in all: along a straight line, turning
    // evenly, slow at both ends. Does as jumpTo() if `seconds` is not above 0.
    void animateTo(const Camera& camera, double seconds);
    [[nodiscard]] bool moves() const { return m_flight.has_value(); } // true during a flight of animateTo()
    // Turns about the forward axis until the right axis is level. Does nothing if the camera looks straight up or
    // down.
    void level();

    // Returns `lens` (name, angles, middle, size and appearance) at the current pose.
    [[nodiscard]] Camera camera(const Camera& lens) const;

private:
    struct Wish;     // a step's input (NavigationInput) with the limits applied
    struct Velocity; // movement as a function of the turns during a step

    struct Flight {
        CameraPose from, to;
        Camera goal;
        double seconds = 0, elapsed = 0;
    };
    struct GivenPose {
        double rotation[9], translation[3]; // pose in the form of Camera::rotation and Camera::translation
    };

    [[nodiscard]] Wish wishOf(const NavigationInput& input) const;
    void follow(const Wish& wish);
    void advance(Flight& flight, double seconds);
    [[nodiscard]] Velocity velocityOf(const Wish& wish) const;
    [[nodiscard]] glm::dvec3 way(const Velocity& velocity, double yaw, double pitch, double growth) const;
    void turn(double yaw, double pitch);
    [[nodiscard]] double pitchAngle() const;
    void setPosition(glm::dvec3 position);
    // index into m_speed of the current mode
    [[nodiscard]] size_t gait() const { return m_mode == NavigationMode::Walk; }

    // the world's up, and two axes across it: m_plane[0], m_plane[1], m_up are a right-handed basis
    glm::dvec3 m_up{}, m_plane[2];
    glm::dvec3 m_middle{};
    double m_diagonal = 1;
    double m_default_speed[2] = {}, m_speed[2] = {}; // speeds of Fly (index 0) and Walk (index 1)
    NavigationMode m_mode = NavigationMode::Fly;
    CameraPose m_pose;
    double m_distance = 1;
    std::optional<GivenPose> m_given; // the bits of the pose that jumpTo() set, while m_pose is that pose
    std::optional<Flight> m_flight;
};

// Distance to what a small picture shows: the median of the depths that are finite. None if there is none.
std::optional<double> medianDepth(std::span<const float> depths);

} // namespace gsc
