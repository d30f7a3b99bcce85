// SPDX-License-Identifier: Apache-2.0
// Which way is up in a model that does not say so: people hold cameras upright.
#pragma once

#include "runtime/camera.h"

#include <array>
#include <span>

namespace gsc {

// The mean of the cameras' up axes, a unit vector of the world. A camera whose axis is not finite or has no length does
// not count. (0, -1, 0), which is up in COLMAP's axes, where none counts or where they disagree so much that the mean is
// shorter than 0.1.
std::array<double, 3> worldUp(std::span<const Camera> cameras);

} // namespace gsc
