// SPDX-License-Identifier: Apache-2.0
// Costs of models at several qualities: rows of `gsc bake --curve`.
#pragma once

#include "runtime/records/run_row.h"

#include <string>
#include <vector>

namespace gsc {

// The rows of a model on a device, in the order that they came: the model itself, then its targets.
struct ChartCurve {
    std::vector<RunRow> rows;
};

// Adds a row, which has the part "curve"; `where` names it in messages. Throws Error(InvalidFile).
void addCurveRow(RunRow row, const std::string& where, std::vector<ChartCurve>& curves);

} // namespace gsc
