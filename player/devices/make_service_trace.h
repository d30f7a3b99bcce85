// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/records/service_trace_report.h"
#include "runtime/service/service_trace.h"

namespace gsc {

// What `trace` and `stats`, of the same service, tell; rates are counted over 120 intervals, each 0.1 s or more. The tool,
// the file and the options are left to the caller.
ServiceTraceReport makeServiceTrace(const ServiceTrace& trace, const ServiceStats& stats);

} // namespace gsc
