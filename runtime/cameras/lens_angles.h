// SPDX-License-Identifier: Apache-2.0
// The angles of a transforms.json, which states them in several ways, and sometimes in more than one.
#pragma once

#include "runtime/cameras/camera_lens.h"
#include <gsc/camera.h>

namespace gsc {

// Sets the angles or focal lengths of `camera`, whose size is read already, from camera_angle_x, fl_x, x_fov (degrees)
// and the same of y. A frame's keys go before the file's, a focal length before an angle where the size is known; keys
// that disagree are told to lens.notes. One axis alone means square pixels. Throws Error(InvalidFile), also where no key is there.
void readLensAngles(const LensKeys& lens, Camera& camera);

} // namespace gsc
