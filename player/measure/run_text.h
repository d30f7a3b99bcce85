// SPDX-License-Identifier: Apache-2.0
// Rows as tables for a person.
#pragma once

#include "runtime/records/run_row.h"

#include <string>

namespace gsc {

// Table of gsc-play bench. Precondition: the row has the part "work".
std::string benchText(const RunRow& row);

// Table of a sweep: a line for each row.
std::string runTableHeader();
std::string runTableLine(const RunRow& row);

// Table of gsc-play stability: a line for each row, then one for each bound that it exceeds. Precondition: the row has the
// part "stability".
std::string stabilityTableHeader();
std::string stabilityTableLine(const RunRow& row);
std::string stabilityTableNotes();

} // namespace gsc
