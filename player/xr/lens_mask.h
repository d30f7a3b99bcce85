// SPDX-License-Identifier: Apache-2.0
// Squares of an eye's picture that nobody sees, because the lens in front of it hides them. Knows no headset.
#pragma once

#include <gsc/frame_types.h>
#include "player/present/headset/headset.h"
#include "player/poses/placement.h"

#include <string>

namespace gsc {

// Fault of a mesh, as "has ..., expected ...", since a runtime's counts and values are hostile. Empty: none.
std::string meshFault(const HiddenMesh& mesh);

// A square is hidden where all its pixels are, and all within kLensMargin of them: code that filters, warps or turns a
// picture reads beyond the pixels seen. A pixel is hidden where its middle lies in a triangle. A row of squares loses
// the hidden ones at its ends; a hidden one between two that are seen is shown. Everything is shown where the mesh has a
// fault, the field of view is none, the picture is wider than a LensShape tells, or nothing at all would be shown.
LensShape lensShape(const HiddenMesh& mesh, const SpaceEye& eye, uint32_t width, uint32_t height);

constexpr int kLensMargin = 2; // pixels

// Pixels of the picture in squares that are left out, of all its pixels: 0 to 1.
double hiddenShare(const LensShape& lens, uint32_t width, uint32_t height);

} // namespace gsc
