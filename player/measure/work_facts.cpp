// SPDX-License-Identifier: Apache-2.0
#include "player/measure/work_facts.h"

#include "player/options/level_report.h"

#include <algorithm>
#include <functional>

namespace gsc {

namespace {

constexpr struct {
    const char* name;
    StageWork FrameWork::*work;
    double StageTimes::*time;
} kRooflineStages[] = {
    {"select", &FrameWork::select, &StageTimes::select}, {"decode", &FrameWork::decode, &StageTimes::decode},
    {"bin", &FrameWork::bin, &StageTimes::bin},          {"sort", &FrameWork::sort, &StageTimes::sort},
    {"blend", &FrameWork::blend, &StageTimes::blend},
};

constexpr struct {
    double StageRoofline::*shown;
    double StageWork::*work;
} kWorkFields[] = {
    {&StageRoofline::bytes_read, &StageWork::bytes_read},
    {&StageRoofline::bytes_written, &StageWork::bytes_written},
    {&StageRoofline::lane_operations, &StageWork::lane_operations},
    {&StageRoofline::exponentials, &StageWork::exponentials},
    {&StageRoofline::matrix_flop, &StageWork::matrix_flop},
};

void finish(StageRoofline& stage, Bound bound)
{
    stage.percent = stage.measured_ms > 0 ? 100 * stage.floor_ms / stage.measured_ms : 0;
    stage.bound = bound == Bound::None ? "" : boundName(bound);
}

// Rooflines of the stages, then of the frame; every number is a median of its own over the frames.
RooflineFacts rooflineFacts(const WorkContext& context, TimedFrames frames)
{
    RooflineFacts facts{context.ceilings, {}};
    const bool sorts_apart =
        std::ranges::any_of(frames, [](const TimedFrame& frame) { return frame.result.times.sort > 0; });
    const auto median = [&](const std::function<double(const TimedFrame&)>& value) {
        return spreadOf(frames, value).median;
    };
    StageRoofline total;
    total.name = "frame";
    for (const auto& stage : kRooflineStages) {
        StageRoofline row;
        row.name = stage.name;
        StageWork work;
        for (const auto& [shown, field] : kWorkFields) {
            row.*shown = work.*field = median([&, field = field](const TimedFrame& frame) {
                return leastWork(context.anchor_cost, frame.result.eyes, context.eyes, frame.pixels, sorts_apart).*
                       (stage.work).*field;
            });
            total.*shown += row.*shown;
        }
        row.measured_ms = median([&](const TimedFrame& frame) {
            const StageTimes& times = frame.result.times;
            // projecting may be timed as a stage of its own, but its work is counted with decode
            return times.*(stage.time) + (stage.time == &StageTimes::decode ? times.project : 0);
        });
        const StageFloor floor = floorOf(work, context.ceilings);
        row.floor_ms = floor.ms;
        total.floor_ms += floor.ms;
        finish(row, floor.bound);
        facts.stages.push_back(row);
    }
    total.measured_ms = median([](const TimedFrame& frame) { return frame.result.times.total; });
    finish(total, Bound::None);
    facts.stages.push_back(total);
    return facts;
}

} // namespace

std::optional<MedianRange> medianRange(TimedFrames frames, size_t cameras)
{
    constexpr size_t kLeast = 6; // with fewer, all lie on one side of the median more often than 5 times of 100
    constexpr double kDeviations = 1.96;
    if (frames.size() < kLeast)
        return std::nullopt;
    std::vector<double> sorted(frames.size());
    std::ranges::transform(frames, sorted.begin(), &TimedFrame::wall_ms);
    std::ranges::sort(sorted);
    const double median = nearestRank(sorted, 0.5);
    // The number of frames below the median is a sum of each camera's, which is binomial. With one camera its variance is
    // a quarter of the frames, as in the sign test. A camera whose frames are all on one side adds less, the less the more
    // frames it has (Krichevsky and Trofimov's estimate of a probability).
    double variance = 0;
    for (size_t camera = 0; camera < std::min(cameras, frames.size()); ++camera) {
        double below = 0, count = 0;
        for (size_t i = camera; i < frames.size(); i += cameras, ++count)
            below += frames[i].wall_ms <= median;
        const double part = (below + 0.5) / (count + 1);
        variance += count * part * (1 - part);
    }
    const double middle = double(sorted.size() - 1) / 2, ranks = kDeviations * std::sqrt(variance);
    return MedianRange{sorted[size_t(std::max(0.0, std::floor(middle - ranks)))],
                       sorted[size_t(std::min(double(sorted.size() - 1), std::ceil(middle + ranks)))]};
}

double percentOf(const MedianRange& range, double median)
{
    return median > 0 ? 100 * std::max(median - range.low, range.high - median) / median : 0;
}

WorkFacts workFacts(const WorkContext& context, TimedFrames frames)
{
    WorkFacts work;
    work.wall_median = medianRange(frames, context.cameras);
    work.ns_per_gaussian = spreadOf(frames, [](const TimedFrame& frame) {
        return frame.result.times.total * 1e6 /
               double(std::max<uint64_t>(ofEyes(frame, &EyeCounts::gaussians_visible), 1));
    });
    for (size_t i = 0; i < std::size(kEyeCounts); ++i)
        work.per_eye[i] = countPerEye(frames, int(context.eyes), kEyeCounts[i].field);
    const auto count = [&](uint64_t FrameResult::*field) {
        return spreadOf(frames, [field](const TimedFrame& frame) { return double(frame.result.*field); });
    };
    work.cache_bytes = count(&FrameResult::cache_bytes);
    work.cache_evictions = count(&FrameResult::cache_evictions);
    for (size_t i = 0; i < std::size(kCoarseCounts); ++i)
        work.coarse[i] = groupsPerFrame(frames, kCoarseCounts[i].field);
    work.passes = spreadOf(frames, [](const TimedFrame& frame) { return double(frame.result.passes); });
    uint64_t most = context.warm_bytes;
    for (const TimedFrame& frame : frames) {
        work.pixels_per_frame += frame.pixels * context.eyes / double(frames.size());
        work.frames_that_grew += most > 0 && frame.result.bytes_resident > most;
        most = std::max(most, frame.result.bytes_resident);
        work.frames_repeated += frame.result.repeats > 0;
        work.repeat_ms += frame.result.repeat_ms;
        work.most_repeat_ms = std::max(work.most_repeat_ms, frame.result.repeat_ms);
    }
    work.target = targetFacts(context.frame, frames);
    if (context.ceilings.known())
        work.roofline = rooflineFacts(context, frames);
    return work;
}

} // namespace gsc
