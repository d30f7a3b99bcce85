// SPDX-License-Identifier: Apache-2.0
// Squares of an eye's picture that the lens in front of it hides. Knows no headset.
#pragma once

#include <gsc/frame_types.h>
#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

#include <string>

namespace gsc {

// Checks a mesh, since a runtime's counts and values are hostile. Returns its fault, as "has ..., expected ...", or "".
std::string meshFault(const HiddenMesh& mesh);

// Finds the hidden squares. A square is hidden if all pixels within kLensMargin of it are: code that filters, warps or turns
// a picture reads beyond the visible pixels. A pixel is hidden if its middle lies in a triangle. Only hidden squares at the
// ends of a row are left out. Everything is shown if the mesh has a fault, the field of view is invalid, the picture is wider
// than a LensShape can tell, or nothing would be shown.
LensShape lensShape(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height);

constexpr int kLensMargin = 2; // pixels

// Share of the picture's pixels in squares that are left out, 0 to 1.
double hiddenShare(const LensShape& lens, uint32_t width, uint32_t height);

} // namespace gsc
