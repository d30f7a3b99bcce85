// SPDX-License-Identifier: Apache-2.0
// Counts in messages and reports.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// 1234567 -> "1,234,567".
std::string formatCount(uint64_t count);
// "1 frame", "1,200 frames"; `plural` where it is not the noun with an s.
std::string formatCount(uint64_t count, const char* noun, const char* plural = nullptr);

} // namespace gsc
