// SPDX-License-Identifier: Apache-2.0
// Counts, times and states of the workers of a service, for the reports.
#pragma once

#include "runtime/records/run_parts.h"
#include "runtime/service/service_renderer.h"

#include <optional>
#include <string>

namespace gsc {

// Numbers of the service behind `renderer`, if that is a ServiceRenderer (several devices draw); otherwise none.
std::optional<ServiceStats> serviceStats(const Renderer& renderer);

std::optional<ServiceFacts> serviceFacts(const std::optional<ServiceStats>& stats);

// Makes the field "workers" of a report; null if no service draws.
OrderedJson workersJson(const std::optional<ServiceStats>& stats);
// Describes the workers in a few lines of text; empty if no service draws.
std::string workersText(const std::optional<ServiceFacts>& service);

} // namespace gsc
