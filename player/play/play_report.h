// SPDX-License-Identifier: Apache-2.0
// Report that gsc-play prints on standard output when it is done.
#pragma once

#include "player/play/play.h"

#include <string>
#include <vector>

namespace gsc {

// A few lines for a person.
std::string playReportText(const PlayOptions& options, const PlaySummary& summary);
// One object, schemas/play-report.schema.json.
std::string playReportJson(const PlayOptions& options, const PlaySummary& summary,
                           const std::vector<std::string>& warnings);

} // namespace gsc
