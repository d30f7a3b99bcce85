// SPDX-License-Identifier: Apache-2.0
// Cameras that no file holds: one's own view, a turn round the model, a way through other cameras. Lengths are world
// units, `up` is a unit vector in the world.
#pragma once

#include <gsc/camera.h>

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace gsc {

struct Sight {
    std::array<double, 3> position{}, target{}; // place of the camera, place in the middle of its picture
};

// Returns true if the two places are far enough apart, for their size, to tell a direction.
bool hasDirection(const Sight& sight);

// Returns `lens` where the sight says, with a level horizon. A camera that looks straight down has at the upper edge of
// its picture what lies ahead of `lens`; one that looks straight up what lies behind it. Precondition: hasDirection().
Camera cameraAt(const Sight& sight, const std::array<double, 3>& up, const Camera& lens);

// Returns a sight from which a turn about the vertical axis through its target shows the model. Target: the point
// nearest to what all cameras look at. Position: the cameras' mean distance and height, on the side of the first one, at
// most 60 degrees above the target. Without cameras that agree on a point ahead: the middle of the box `low` to `high`,
// from outside, 30 degrees above it.
Sight turntableSight(std::span<const Camera> cameras, const std::array<double, 3>& up, const std::array<double, 3>& low,
                     const std::array<double, 3>& high);

// Returns the largest part of the turn, radians, over which none of the cameras stands, as seen from the target.
double widestGap(std::span<const Camera> cameras, const Sight& sight, const std::array<double, 3>& up);

// Returns the cameras of a full turn, counter-clockwise as seen from above; the first one is at the sight, and the one
// behind the last would be there again.
std::vector<Camera> turntable(const Sight& sight, const std::array<double, 3>& up, const Camera& lens, size_t frames);

// Returns cameras on a smooth way (a Catmull-Rom spline) through `keys`, which begins at the first and ends at the last, at about
// an even pace. A frame at the place of a key has that key's pose and lens bit for bit; size and appearance are
// those of the first key. Preconditions: two keys or more, with poses (poseOf()); at least two frames.
std::vector<Camera> wayThrough(std::span<const Camera> keys, size_t frames);

// Puts cameras in the order of their names, in which numbers count by their value: the order in which photographs are
// mostly taken.
void sortByName(std::vector<Camera>& cameras);

} // namespace gsc
