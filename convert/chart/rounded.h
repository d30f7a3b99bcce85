// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace gsc {

// The value with five digits: more than a measurement has, and it halves the page's size. Null if it is not finite.
inline nlohmann::ordered_json rounded(double value)
{
    if (!std::isfinite(value))
        return nullptr;
    char text[40];
    std::snprintf(text, sizeof(text), "%.5g", value);
    const double short_value = std::strtod(text, nullptr);
    constexpr double kWhole = 1e15;
    if (std::abs(short_value) < kWhole && short_value == std::floor(short_value))
        return int64_t(short_value);
    return short_value;
}

} // namespace gsc
