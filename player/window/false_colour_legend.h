// SPDX-License-Identifier: Apache-2.0
// What false colours mean, to be shown beside the picture.
#pragma once

#include "kernels/frame/frame_types.h"
#include "player/present/overlay.h"

namespace gsc {

OverlayLegend legendOf(FrameView view, uint32_t levels); // empty for pictures

} // namespace gsc
