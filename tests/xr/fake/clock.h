// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "openxr_headers.h"

namespace gsc::fake_xr {

// Numbers the refreshes of the display. Times are OpenXR's, in nanoseconds.
class RefreshGrid {
public:
    void start(double hz, XrTime first, int64_t index = 0);
    void setRate(double hz, int64_t from_index); // refreshes up to this one stay where they are
    [[nodiscard]] double rate() const { return m_hz; }
    [[nodiscard]] XrTime timeOf(int64_t index) const;
    [[nodiscard]] XrDuration period() const;
    [[nodiscard]] int64_t indexAfter(XrTime time) const; // the first refresh later than time

private:
    double m_hz = 90;
    XrTime m_first = 0;
    int64_t m_index = 0;
};

XrTime monotonicNow();
void sleepUntil(XrTime time);

} // namespace gsc::fake_xr
