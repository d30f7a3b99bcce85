// SPDX-License-Identifier: Apache-2.0
// Constants for the numbers in the issue table, such as gsc::issue::ChunkOrigin == 4009.
#pragma once

#include <cinttypes>
#include <cstdint>

namespace gsc {

namespace issue {
#define GSC_ISSUE(id, severity, name, summary, detail) inline constexpr uint16_t name = id;
#include <gsc/gsc_issues.def>
#undef GSC_ISSUE
} // namespace issue

// Formats of the issues' details as constants, so that the compiler checks the arguments of every report.
namespace issue_detail {
#define GSC_ISSUE(id, severity, name, summary, detail) inline constexpr char name[] = detail;
#include <gsc/gsc_issues.def>
#undef GSC_ISSUE
} // namespace issue_detail

} // namespace gsc
