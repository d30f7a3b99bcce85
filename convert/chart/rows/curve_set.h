// SPDX-License-Identifier: Apache-2.0
// Curves: rows of `gsc bake --curve`, the costs of a model at several qualities.
#pragma once

#include "runtime/records/run_row.h"

#include <string>
#include <vector>

namespace gsc {

// Rows of one model on one device, in the order of the input: the model itself, then the model baked to each target.
struct ChartCurve {
    std::vector<RunRow> rows;
};

// Adds a row, which has the part "curve"; `where` names it in messages. Throws Error(InvalidFile).
void addCurveRow(RunRow row, const std::string& where, std::vector<ChartCurve>& curves);

} // namespace gsc
