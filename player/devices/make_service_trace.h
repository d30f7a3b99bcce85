// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/records/service_trace_report.h"
#include "runtime/service/service_trace.h"

namespace gsc {

// Makes the report of one service from its `trace` and `stats`. Pictures per second are counted in up to 120 equal
// intervals of at least 0.1 s. The caller fills in the tool, the file and the options.
ServiceTraceReport makeServiceTrace(const ServiceTrace& trace, const ServiceStats& stats);

} // namespace gsc
