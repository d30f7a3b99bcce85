// SPDX-License-Identifier: Apache-2.0
// Counts, times and states of devices that draw together, for the reports.
#pragma once

#include "runtime/records/run_parts.h"
#include "runtime/service/service_renderer.h"

#include <optional>
#include <string>

namespace gsc {

// Numbers of the service behind `renderer`, if several devices draw for it (ServiceRenderer); none of another.
std::optional<ServiceStats> serviceStats(const Renderer& renderer);

std::optional<ServiceFacts> serviceFacts(const std::optional<ServiceStats>& stats);

// "workers" of a report; null without.
OrderedJson workersJson(const std::optional<ServiceStats>& stats);
// Some lines; empty without.
std::string workersText(const std::optional<ServiceFacts>& service);

} // namespace gsc
