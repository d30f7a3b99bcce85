// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/records/service_trace_report.h"
#include "runtime/service/service_trace.h"

namespace gsc {

// Report of one service's `trace` and `stats`; rates are counted over 120 intervals, each 0.1 s or more. The caller
// fills in the tool, the file and the options.
ServiceTraceReport makeServiceTrace(const ServiceTrace& trace, const ServiceStats& stats);

} // namespace gsc
