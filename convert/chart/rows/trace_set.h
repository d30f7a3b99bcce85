// SPDX-License-Identifier: Apache-2.0
// Traces of renderer services, one to a line of a file.
#pragma once

#include "runtime/records/service_trace_report.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// A trace with a name.
struct ChartTrace : ServiceTraceReport {
    std::string title; // name of its file, with a number if the file has several
};

// True if the text begins with a trace, not with a row.
bool isTraceText(std::string_view text);

// Adds the traces of `text`; `path` names it in messages. Throws Error(InvalidFile, Unsupported, Interrupted).
void addTraces(std::string_view text, const std::string& path, std::vector<ChartTrace>& traces);

} // namespace gsc
