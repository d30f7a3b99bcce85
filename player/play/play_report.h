// SPDX-License-Identifier: Apache-2.0
// The report that gsc-play prints on standard output at the end of a run.
#pragma once

#include "player/play/play.h"

#include <string>
#include <vector>

namespace gsc {

// Returns the report as a few lines of text.
std::string playReportText(const PlayOptions& options, const PlaySummary& summary);
// Returns the report as one JSON object; schemas/play-report.schema.json describes it.
std::string playReportJson(const PlayOptions& options, const PlaySummary& summary,
                           const std::vector<std::string>& warnings);

} // namespace gsc
