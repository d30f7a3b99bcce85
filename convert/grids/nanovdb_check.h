// SPDX-License-Identifier: Apache-2.0
// The stored NanoVDB grids against NanoVDB's own reader and against the leaves and anchors of the file.
#pragma once

#include <gsc/gsc_reader.h>

namespace gsc {

// Precondition: `view` came from openGsc() without errors. True if nothing was reported. Nothing in a grid is
// dereferenced before it is known to stay inside the grid.
bool checkNanoVdb(const GscView& view, const IssueSink& sink);

} // namespace gsc
