// SPDX-License-Identifier: Apache-2.0
// A viewer who is carried along the cameras of a file, at the pace they were made for. Pure.
#pragma once

#include "player/poses/placement.h"

#include <vector>

namespace gsc {

class Ride {
public:
    // At least one camera; `fps` of them a second. The rest is as Placement has it.
    Ride(std::vector<Camera> cameras, double fps, const std::array<double, 3>& up, double metre, double eye_height);

    // Where the space is after so many seconds: on the straight way between two cameras; before the first and after the last
    // it stands there.
    [[nodiscard]] Placement at(double seconds) const;

private:
    std::vector<Camera> m_cameras;
    double m_fps;
    std::array<double, 3> m_up;
    double m_metre, m_eye_height;
};

} // namespace gsc
