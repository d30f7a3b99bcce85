// SPDX-License-Identifier: Apache-2.0
// Which squares of an eye's picture nobody sees, because the lens in front of it hides them. Knows no headset.
#pragma once

#include <gsc/frame_types.h>
#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

#include <string>

namespace gsc {

// What is wrong with a mesh, as "has ..., expected ...": a runtime's counts and values are hostile. Empty: nothing.
std::string meshFault(const HiddenMesh& mesh);

// A square is hidden where all its pixels are, and all that are within kLensMargin of them: what filters, warps or turns a
// picture reads beyond what is seen. A pixel is hidden where its middle lies in a triangle. Of a row of squares those at
// its ends are left out; a hidden one between two that are seen is shown. Everything is shown of a mesh that has a fault,
// of a field of view that is none, of a picture wider than a LensShape tells, and where nothing at all would be.
LensShape lensShape(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height);

constexpr int kLensMargin = 2; // pixels

// Pixels of the picture in squares that are left out, of all its pixels: 0 to 1.
double hiddenShare(const LensShape& lens, uint32_t width, uint32_t height);

} // namespace gsc
