// SPDX-License-Identifier: Apache-2.0
// Within a step yaw, pitch and speed change at even rates, so the way is an integral of exponentials, which has a
// closed form. So several short steps end where one long step does, even if the camera turns while it moves.
#include "player/window/navigation.h"

#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <numbers>
#include <vector>

namespace gsc {

namespace {

using Complex = std::complex<double>;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSteepest = 89 * kDegree;
constexpr double kFlyMetres = 5, kWalkMetres = 1.4; // default speeds, metres per second
constexpr double kSceneShare = 1.0 / 20; // default speed if the metre is unknown, diagonals of the scene per second
constexpr double kOrbitPace = 0.5;       // speed in Orbit, distances to the target per second
constexpr double kNotch = 1.25, kFast = 4, kSlow = 0.25;
constexpr double kStickRate = 90 * kDegree; // fastest turn by a stick, radians per second
constexpr double kSpeedRange = 1e3;         // largest factor between a chosen speed and the default one
// limits in diagonals of the scene: of the distance to the target; of the position
constexpr double kNearest = 1e-6, kFarthest = 1e3, kReach = 1e6;
// limits of the input: more than a hand can do, and small enough that squares and exponentials stay finite
constexpr double kMostPixels = 1e6, kMostNotches = 100, kMostSeconds = 1e4, kMostTurn = 1e4;

double checked(double value, double most)
{
    return std::isfinite(value) ? std::clamp(value, -most, most) : 0;
}

glm::dvec3 checkedPoint(const double v[3])
{
    return {checked(v[0], 1e100), checked(v[1], 1e100), checked(v[2], 1e100)};
}

// Focal length in pixels: dragging the picture by one pixel turns the camera by 1 / focal radians.
double focalOf(uint32_t height, double fov_y)
{
    const bool known = height > 0 && fov_y >= 1e-6 && fov_y < std::numbers::pi - 1e-6;
    return known ? 0.5 * height / std::tan(fov_y / 2) : 540;
}

// Integral of e^(zu) for u from 0 to 1.
Complex meanExponential(Complex z)
{
    if (std::abs(z) > 1)
        return (std::exp(z) - 1.0) / z;
    // for small z the closed formula loses precision by cancellation, but the series does not: its 18th term is below
    // 1e-16
    Complex sum = 1, term = 1;
    for (int n = 2; n <= 18; ++n)
        sum += term *= z / double(n);
    return sum;
}

// Share of a step, 0 to 1, after which `value` meets `low` or `high`. `change` is the value's change over the whole
// step.
double shareUntil(double value, double change, double low, double high)
{
    if (change == 0)
        return 1;
    return std::clamp(((change > 0 ? high : low) - value) / change, 0.0, 1.0);
}

// Returns a unit vector perpendicular to `axis`, a unit vector: in the direction of `wanted`, or any if `wanted` is
// parallel to `axis`.
glm::dvec3 across(const glm::dvec3& axis, const glm::dvec3& wanted)
{
    glm::dvec3 part = wanted - axis * dot(axis, wanted);
    if (!(length(part) > 1e-6)) {
        const glm::dvec3 other = std::abs(axis.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        part = other - axis * dot(axis, other);
    }
    return normalize(part);
}

} // namespace

struct Navigator::Wish {
    double seconds = 0;
    glm::dvec3 move{};  // movement over the step to the right, up and forward, as a factor on the speed
    double pan[2] = {}; // movement over the step to the right and down, as a factor on the distance to the target
    double yaw = 0, pitch = 0; // turn over the step to the left and up, radians
    double growth = 0;         // logarithm of the factor by which speed or distance grow over the step

    [[nodiscard]] bool isNone() const
    {
        return move == glm::dvec3(0.0) && pan[0] == 0 && pan[1] == 0 && yaw == 0 && pitch == 0 && growth == 0;
    }
};

// Movement over a step at speed or distance 1, as a function of the angle `a` by which the camera is pitched: even +
// cosine * cos(a) + sine * sin(a).
struct Navigator::Velocity {
    glm::dvec3 even{}, cosine{}, sine{};
};

Navigator::Navigator(const NavigationWorld& world)
{
    const glm::dvec3 up = checkedPoint(world.up);
    m_up = length(up) > 1e-9 && length(up) < 1e9 ? normalize(up) : glm::dvec3(0, -1, 0);
    m_plane[0] = across(m_up, {0, 0, 1});
    m_plane[1] = cross(m_up, m_plane[0]);

    const glm::dvec3 low = checkedPoint(world.low), high = checkedPoint(world.high);
    m_middle = (low + high) / 2.0;
    m_diagonal = length(high - low);
    if (!(m_diagonal > 1e-12))
        m_diagonal = 1;

    const bool has_metre = world.metre > 1e-15 && world.metre < 1e15;
    m_default_speed[0] = has_metre ? kFlyMetres * world.metre : kSceneShare * m_diagonal;
    m_default_speed[1] = m_default_speed[0] * (kWalkMetres / kFlyMetres);
    std::copy_n(m_default_speed, 2, m_speed);

    m_distance = m_diagonal;
    const glm::dvec3 forward = m_plane[0] * std::cos(30 * kDegree) - m_up * std::sin(30 * kDegree);
    m_pose.axes = orthonormal({glm::dvec3(0.0), -m_up, forward});
    setPosition(m_middle - forward * m_distance);
}

double Navigator::speed() const
{
    return m_mode == NavigationMode::Orbit ? kOrbitPace * m_distance : m_speed[gait()];
}

void Navigator::setSpeed(double speed)
{
    if (m_mode == NavigationMode::Orbit || !(speed > 0))
        return;
    const double usual = m_default_speed[gait()];
    m_speed[gait()] = std::clamp(speed, usual / kSpeedRange, usual * kSpeedRange);
}

void Navigator::setUsualSpeed(double speed)
{
    if (!(speed > 0))
        return;
    const double usual = std::clamp(speed, m_diagonal / 2000, m_diagonal / 2);
    m_speed[0] *= usual / m_default_speed[0];
    m_default_speed[0] = usual;
}

void Navigator::setDistance(double distance)
{
    if (distance > 0) // ignores a distance that is not positive, or NaN
        m_distance = std::clamp(distance, kNearest * m_diagonal, kFarthest * m_diagonal);
}

std::array<double, 3> Navigator::target() const
{
    const glm::dvec3 t = m_pose.position + m_pose.axes[2] * m_distance;
    return {t.x, t.y, t.z};
}

std::array<double, 3> Navigator::position() const
{
    return {m_pose.position.x, m_pose.position.y, m_pose.position.z};
}

Navigator::Wish Navigator::wishOf(const NavigationInput& input) const
{
    Wish wish;
    wish.seconds = std::max(0.0, checked(input.seconds, kMostSeconds));
    const double focal = focalOf(input.height, input.fov_y);
    const double gear = (input.fast ? kFast : 1) * (input.slow ? kSlow : 1);
    for (int i = 0; i < 3; ++i)
        wish.move[i] = checked(input.move[i], 1);
    wish.move *= wish.seconds * gear / std::max(1.0, length(wish.move));
    // dragging the picture to the right turns the view to the left; a stick turns the view itself
    double turn[2];
    for (size_t i = 0; i < 2; ++i) {
        const double drag = checked(input.look_pixels[i], kMostPixels) / focal;
        const double stick = checked(input.look_rate[i], 1) * kStickRate * wish.seconds;
        turn[i] = checked(drag - stick, kMostTurn);
        wish.pan[i] = m_mode == NavigationMode::Orbit ? checked(input.pan_pixels[i], kMostPixels) / focal : 0;
    }
    wish.yaw = turn[0];
    wish.pitch = turn[1];
    const double notches = checked(input.scroll, kMostNotches);
    wish.growth = std::log(kNotch) * (m_mode == NavigationMode::Orbit ? -notches : notches);
    return wish;
}

bool Navigator::step(const NavigationInput& input)
{
    const Wish wish = wishOf(input);
    const CameraPose before = m_pose;
    if (!wish.isNone()) {
        m_flight.reset();
        follow(wish);
    } else if (m_flight) {
        Flight flight = *m_flight;
        advance(flight, wish.seconds);
    }
    return before.position != m_pose.position || before.axes != m_pose.axes;
}

void Navigator::follow(const Wish& wish)
{
    const bool orbits = m_mode == NavigationMode::Orbit;
    const CameraPose before = m_pose;
    // distance to the target in Orbit, else speed: the movement of a step is proportional to it
    double& scale = orbits ? m_distance : m_speed[gait()];
    const double usual = orbits ? m_diagonal : m_default_speed[gait()];
    const double low = orbits ? kNearest * usual : usual / kSpeedRange;
    const double high = orbits ? kFarthest * usual : usual * kSpeedRange;

    // where pitch or scale meet a limit during the step, the step is divided; otherwise the result would depend on the
    // length of steps
    const double pitch = pitchAngle();
    const double pitching = shareUntil(pitch, wish.pitch, std::min(pitch, -kSteepest), std::max(pitch, kSteepest));
    const double scaling = shareUntil(std::log(scale), wish.growth, std::log(low), std::log(high));
    const double scale_before = scale;
    glm::dvec3 way_of_step(0.0); // movement of the camera; in Orbit, of the target that it turns about
    double from = 0;
    for (const double to : {std::min(pitching, scaling), std::max(pitching, scaling), 1.0}) {
        const double part = to - from;
        if (!(part > 0))
            continue;
        const double pitch_part = from < pitching ? wish.pitch * part : 0;
        const double growth_part = from < scaling ? wish.growth * part : 0;
        way_of_step += way(velocityOf(wish), wish.yaw * part, pitch_part, growth_part) * (part * scale);
        turn(wish.yaw * part, pitch_part);
        scale = std::clamp(scale * std::exp(growth_part), low, high);
        from = to;
    }
    // a step that changes nothing, for instance at a limit, keeps the bits of the pose that jumpTo() set
    if (way_of_step == glm::dvec3(0.0) && m_pose.axes == before.axes && (!orbits || scale == scale_before))
        return;
    CameraPose after{before.position + way_of_step, m_pose.axes};
    if (orbits)
        after.position += before.axes[2] * scale_before - after.axes[2] * scale;
    if (isFinite(after))
        setPosition(after.position);
    else
        m_pose = before;
}

Navigator::Velocity Navigator::velocityOf(const Wish& wish) const
{
    const glm::dvec3 right = m_pose.axes[0], down = m_pose.axes[1], forward = m_pose.axes[2];
    // Walk ignores the pitch: looking up or down changes neither the direction nor the speed of the movement
    if (m_mode == NavigationMode::Walk) {
        const glm::dvec3 level_right = across(m_up, right);
        return {level_right * wish.move[0] + cross(m_up, level_right) * wish.move[2], {}, {}};
    }
    Velocity velocity;
    velocity.even = right * wish.move[0] + m_up * wish.move[1];
    double along_down = 0, along_forward = wish.move[2];
    if (m_mode == NavigationMode::Orbit) {
        velocity.even = velocity.even * kOrbitPace - right * wish.pan[0];
        along_down = -wish.pan[1];
        along_forward *= kOrbitPace;
    }
    // a camera pitched up by b has down' = down cos b + forward sin b and forward' = forward cos b - down sin b
    velocity.cosine = down * along_down + forward * along_forward;
    velocity.sine = forward * along_down - down * along_forward;
    return velocity;
}

// Integral of e^(growth u) Yaw(yaw u) velocity(pitch u) over a step, u from 0 to 1. The parts of vectors across the up
// axis are treated as complex numbers, which a yaw multiplies.
glm::dvec3 Navigator::way(const Velocity& velocity, double yaw, double pitch, double growth) const
{
    const auto integral = [&](double turn) { return meanExponential(Complex(growth, turn)); };
    const auto flat = [&](const glm::dvec3& v) { return Complex(dot(v, m_plane[0]), dot(v, m_plane[1])); };
    const Complex still = integral(pitch);
    const double along = dot(velocity.even, m_up) * integral(0).real() + dot(velocity.cosine, m_up) * still.real() +
                         dot(velocity.sine, m_up) * still.imag();
    const Complex plus = integral(yaw + pitch), minus = integral(yaw - pitch);
    const Complex cosine = (plus + minus) / 2.0, sine = (plus - minus) / Complex(0, 2);
    const Complex plane =
        flat(velocity.even) * integral(yaw) + flat(velocity.cosine) * cosine + flat(velocity.sine) * sine;
    return m_plane[0] * plane.real() + m_plane[1] * plane.imag() + m_up * along;
}

void Navigator::turn(double yaw, double pitch)
{
    if (yaw == 0 && pitch == 0)
        return;
    const glm::dvec3 down = m_pose.axes[1], forward = m_pose.axes[2];
    glm::dmat3 turned = m_pose.axes;
    turned[1] = down * std::cos(pitch) + forward * std::sin(pitch);
    turned[2] = forward * std::cos(pitch) - down * std::sin(pitch);
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 axis = turned[i];
        const Complex plane = Complex(dot(axis, m_plane[0]), dot(axis, m_plane[1])) * std::polar(1.0, yaw);
        turned[i] = m_plane[0] * plane.real() + m_plane[1] * plane.imag() + m_up * dot(axis, m_up);
    }
    m_pose.axes = orthonormal(turned);
}

// Angle by which the camera is pitched up about its own right axis, counted from the most level direction on that
// circle. Without roll it is the elevation of the forward axis.
double Navigator::pitchAngle() const
{
    const double ahead = dot(m_pose.axes[2], m_up), above = -dot(m_pose.axes[1], m_up);
    // the right axis is vertical: no direction on the circle is more level than another
    return std::hypot(ahead, above) < 1e-9 ? 0 : std::atan2(ahead, above);
}

void Navigator::setPosition(glm::dvec3 position)
{
    const double reach = kReach * m_diagonal;
    const glm::dvec3 offset = position - m_middle;
    const double far = length(offset);
    m_pose.position = far <= reach ? position : m_middle + offset * (reach / far);
    m_given.reset();
}

void Navigator::jumpTo(const Camera& camera)
{
    const std::optional<CameraPose> pose = poseOf(camera);
    if (!pose || !(length(pose->position) < 1e150))
        return;
    m_flight.reset();
    m_pose.axes = pose->axes;
    setPosition(pose->position);
    if (m_pose.position == pose->position && hasRotation(camera)) {
        m_given.emplace();
        std::copy_n(camera.rotation, 9, m_given->rotation);
        std::copy_n(camera.translation, 3, m_given->translation);
    }
}

void Navigator::animateTo(const Camera& camera, double seconds)
{
    const std::optional<CameraPose> pose = poseOf(camera);
    if (!pose || !(length(pose->position) < 1e150))
        return;
    m_flight.reset();
    if (seconds > 0) // takes no step for a time that is not positive, or NaN
        m_flight = Flight{m_pose, *pose, camera, std::min(seconds, kMostSeconds), 0};
    else
        jumpTo(camera);
}

void Navigator::advance(Flight& flight, double seconds)
{
    flight.elapsed += seconds;
    const double t = flight.elapsed / flight.seconds;
    if (!(t < 1)) {
        jumpTo(flight.goal); // sets the exact goal, which ends the flight
        return;
    }
    const CameraPose pose = between(flight.from, flight.to, t * t * (3 - 2 * t));
    m_pose.axes = pose.axes;
    setPosition(pose.position);
    m_flight = flight;
}

void Navigator::level()
{
    m_flight.reset();
    const glm::dvec3 forward = m_pose.axes[2];
    glm::dvec3 right = cross(forward, m_up);
    if (!(length(right) > 1e-6))
        right = across(forward, m_pose.axes[0]);
    right = normalize(right);
    m_pose.axes = orthonormal({right, cross(forward, right), forward});
    m_given.reset();
}

Camera Navigator::camera(const Camera& lens) const
{
    Camera camera = lens;
    if (m_given) {
        std::copy_n(m_given->rotation, 9, camera.rotation);
        std::copy_n(m_given->translation, 3, camera.translation);
    } else {
        setPose(m_pose, camera);
    }
    return camera;
}

std::optional<double> medianDepth(std::span<const float> depths)
{
    std::vector<float> finite;
    std::ranges::copy_if(depths, std::back_inserter(finite), [](float depth) { return std::isfinite(depth); });
    const auto median = finite.begin() + ptrdiff_t(finite.size() / 2);
    std::nth_element(finite.begin(), median, finite.end());
    return median == finite.end() ? std::nullopt : std::optional<double>(*median);
}

} // namespace gsc
