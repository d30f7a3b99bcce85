// SPDX-License-Identifier: Apache-2.0
// What two eyes have in common.
#pragma once

#include <gsc/frame_types.h>

namespace gsc {

// Do both eyes see every point at the same view z, but for what rounding makes of it? So do eyes that look the same way,
// neither ahead of the other, as in a headset without canted displays.
bool sameDepths(const EyeParams& left, const EyeParams& right);

} // namespace gsc
