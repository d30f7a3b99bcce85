// SPDX-License-Identifier: Apache-2.0
// The clock of a renderer service.
#pragma once

#include <chrono>

namespace gsc {

using ServiceTime = std::chrono::nanoseconds; // time since the service began

class ServiceClock {
public:
    [[nodiscard]] ServiceTime now() const { return std::chrono::steady_clock::now() - m_from; }

private:
    const std::chrono::steady_clock::time_point m_from = std::chrono::steady_clock::now();
};

} // namespace gsc
