// SPDX-License-Identifier: Apache-2.0
// Text of counts, for messages and reports.
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

// Digits in groups of three: 1234567 -> "1,234,567".
std::string formatCount(uint64_t count);
// Count and noun: "1 frame", "1,200 frames"; `plural` is given where it is not the noun with an s.
std::string formatCount(uint64_t count, const char* noun, const char* plural = nullptr);

} // namespace gsc
