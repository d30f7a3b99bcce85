// SPDX-License-Identifier: Apache-2.0
// Constants of the issue table: gsc::issue::ChunkOrigin == 4009.
#pragma once

#include <cinttypes>
#include <cstdint>

namespace gsc {

namespace issue {
#define GSC_ISSUE(id, severity, name, summary, detail) inline constexpr uint16_t name = id;
#include <gsc/gsc_issues.def>
#undef GSC_ISSUE
} // namespace issue

// The detail formats one by one, so that the compiler checks the arguments of every report.
namespace issue_detail {
#define GSC_ISSUE(id, severity, name, summary, detail) inline constexpr char name[] = detail;
#include <gsc/gsc_issues.def>
#undef GSC_ISSUE
} // namespace issue_detail

} // namespace gsc
