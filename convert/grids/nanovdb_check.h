// SPDX-License-Identifier: Apache-2.0
// Checks the stored NanoVDB grids with NanoVDB's own reader, and compares them with the leaves and anchors of the file.
#pragma once

#include <gsc/gsc_reader.h>

namespace gsc {

// Reports every fault to `sink`; returns true if there was none. Precondition: `view` came from openGsc() without
// errors. No pointer in a grid is followed before it is known to stay inside the grid.
bool checkNanoVdb(const GscView& view, const IssueSink& sink);

} // namespace gsc
