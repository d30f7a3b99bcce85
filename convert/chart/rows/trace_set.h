// SPDX-License-Identifier: Apache-2.0
// Traces of renderer services, one a line, as files hold them.
#pragma once

#include "runtime/records/service_trace_report.h"

#include <string>
#include <string_view>
#include <vector>

namespace gsc {

struct ChartTrace : ServiceTraceReport {
    std::string title; // the file it came from, with a number where there are several
};

// Does it begin with a trace, rather than with a run of a sweep?
bool isTraceText(std::string_view text);

// Adds the traces of `text`; `path` names it in messages. Throws Error(InvalidFile, Unsupported, Interrupted).
void addTraces(std::string_view text, const std::string& path, std::vector<ChartTrace>& traces);

} // namespace gsc
