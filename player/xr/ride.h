// SPDX-License-Identifier: Apache-2.0
// Carries a viewer along the cameras of a file at a constant rate. Pure.
#pragma once

#include "player/poses/placement.h"

#include <vector>

namespace gsc {

class Ride {
public:
    // At least one camera; `fps`: cameras per second. The other arguments are those of Placement.
    Ride(std::vector<Camera> cameras, double fps, const std::array<double, 3>& up, double metre, double eye_height);

    // Placement of the space after so many seconds: on the straight line between two cameras; at the first before it, at the
    // last after it.
    [[nodiscard]] Placement at(double seconds) const;

private:
    std::vector<Camera> m_cameras;
    double m_fps;
    std::array<double, 3> m_up;
    double m_metre, m_eye_height;
};

} // namespace gsc
