// SPDX-License-Identifier: Apache-2.0
// Tests whether the two eyes of a frame see equal depths.
#pragma once

#include <gsc/frame_types.h>

namespace gsc {

// Returns true if both eyes see every point at the same view z, up to rounding: they look the same way and neither is
// ahead of the other, as in a headset without canted displays.
bool sameDepths(const EyeParams& left, const EyeParams& right);

} // namespace gsc
