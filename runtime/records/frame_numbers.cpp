// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/frame_numbers.h"

#include <algorithm>

namespace gsc {

Spread spreadOf(TimedFrames frames, const std::function<double(const TimedFrame&)>& value)
{
    std::vector<double> values(frames.size());
    std::ranges::transform(frames, values.begin(), value);
    return spreadOf(std::move(values));
}

uint64_t sumOf(TimedFrames frames, uint64_t FrameResult::*field)
{
    uint64_t sum = 0;
    for (const TimedFrame& frame : frames)
        sum += frame.result.*field;
    return sum;
}

uint64_t mostOf(TimedFrames frames, uint64_t FrameResult::*field)
{
    uint64_t most = 0;
    for (const TimedFrame& frame : frames)
        most = std::max(most, frame.result.*field);
    return most;
}

uint64_t ofEyes(const TimedFrame& frame, uint64_t EyeCounts::*field)
{
    uint64_t sum = 0;
    for (const EyeCounts& eye : frame.result.eyes) // counts of an absent eye are 0
        sum += eye.*field;
    return sum;
}

Spread groupsPerFrame(TimedFrames frames, uint64_t CoarseCounts::*field)
{
    return spreadOf(frames, [&](const TimedFrame& frame) { return double(frame.result.coarse.*field); });
}

Spread countPerEye(TimedFrames frames, int eyes, uint64_t EyeCounts::*field)
{
    return spreadOf(frames, [&](const TimedFrame& frame) { return double(ofEyes(frame, field)) / eyes; });
}

FrameTimes timesOf(TimedFrames frames)
{
    FrameTimes times{spreadOf(frames, &TimedFrame::wall_ms),
                     spreadOf(frames, [](const TimedFrame& f) { return f.result.times.total; }),
                     {}};
    for (size_t i = 0; i < std::size(kStages); ++i)
        times.stages[i] = spreadOf(frames, [i](const TimedFrame& f) { return f.result.times.*(kStages[i].field); });
    return times;
}

TimedFrames timedFrames(TimedFrames frames, uint32_t warmup)
{
    return frames.subspan(std::min<size_t>(warmup, frames.size() - 1));
}

ReuseCounts reuseCounts(TimedFrames frames)
{
    const auto sum = [&](uint64_t EyeCounts::*field) {
        uint64_t count = 0;
        for (const TimedFrame& frame : frames)
            count += ofEyes(frame, field);
        return count;
    };
    const auto visible = double(sum(&EyeCounts::anchors_visible));
    return {countPerEye(frames, 1, &EyeCounts::anchors_decoded),
            countPerEye(frames, 1, &EyeCounts::anchors_reused),
            visible > 0 ? double(sum(&EyeCounts::anchors_reused)) / visible : 0.0,
            sum(&EyeCounts::anchors_overdue),
            sumOf(frames, &FrameResult::cache_evictions),
            mostOf(frames, &FrameResult::cache_bytes)};
}

} // namespace gsc
