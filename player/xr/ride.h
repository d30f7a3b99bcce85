// SPDX-License-Identifier: Apache-2.0
// Carries a viewer along a list of cameras at a constant rate. No input but its arguments.
#pragma once

#include "player/poses/placement.h"

#include <vector>

namespace gsc {

class Ride {
public:
    // Takes at least one camera; `fps` is cameras per second. The other arguments are those of Placement.
    Ride(std::vector<Camera> cameras, double fps, const std::array<double, 3>& up, double metre, double eye_height);

    // Placement of the space after `seconds`: on the straight line between two cameras; at the first camera before it,
    // at the last camera after it.
    [[nodiscard]] Placement at(double seconds) const;

private:
    std::vector<Camera> m_cameras;
    double m_fps;
    std::array<double, 3> m_up;
    double m_metre, m_eye_height;
};

} // namespace gsc
