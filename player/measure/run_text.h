// SPDX-License-Identifier: Apache-2.0
// Measurements as tables for a person.
#pragma once

#include "runtime/records/run_row.h"

#include <string>

namespace gsc {

// The table of gsc-play bench. Precondition: the row has the part "work".
std::string benchText(const RunRow& row);

// The table of a sweep: a line for each row.
std::string runTableHeader();
std::string runTableLine(const RunRow& row);

// The table of gsc-play stability: a line for each row, which has the part "stability", with lines of the bounds that it exceeds.
std::string stabilityTableHeader();
std::string stabilityTableLine(const RunRow& row);
std::string stabilityTableNotes();

} // namespace gsc
