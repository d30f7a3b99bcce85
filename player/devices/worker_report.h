// SPDX-License-Identifier: Apache-2.0
// Counts, times and states of devices that draw together, for the reports.
#pragma once

#include "runtime/cli/json.h"
#include "runtime/service/service_renderer.h"

#include <optional>
#include <string>

namespace gsc {

// Numbers of the service behind `renderer`, if several devices draw for it (ServiceRenderer); none of another.
std::optional<ServiceStats> serviceStats(const Renderer& renderer);

// "workers" of a report (schemas/bench-report.schema.json); null without.
OrderedJson workersJson(const std::optional<ServiceStats>& stats);
// Some lines; empty without.
std::string workersText(const std::optional<ServiceStats>& stats);

} // namespace gsc
