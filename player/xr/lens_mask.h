// SPDX-License-Identifier: Apache-2.0
// Finds the squares of an eye's picture that the headset's lens hides. Needs no headset.
#pragma once

#include <gsc/frame_types.h>
#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

#include <string>

namespace gsc {

// Checks a mesh, because a runtime's counts and values are hostile. Returns the fault as "has ..., expected ...", or
// an empty text.
std::string meshFault(const HiddenMesh& mesh);

// Finds the hidden squares. A pixel is hidden if its middle lies in a triangle of the mesh. A square is hidden if all
// pixels within kLensMargin of it are, because code that filters, warps or turns a picture reads beyond the visible
// pixels. Only hidden squares at the ends of a row are left out. Nothing is left out if the mesh has a fault, the
// field of view is invalid, the picture is wider than a LensShape can state, or nothing would be left.
LensShape lensShape(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height);

constexpr int kLensMargin = 2; // width of the border round a square that must be hidden, too, pixels

// Share of the picture's pixels, 0 to 1, that lie in squares that are left out.
double hiddenShare(const LensShape& lens, uint32_t width, uint32_t height);

} // namespace gsc
