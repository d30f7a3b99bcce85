// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/run_parts.h"

#include "runtime/records/accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

const FieldKind kDetailTimes = {[](const OrderedJson& v) {
                                    return v.is_object() && std::ranges::all_of(kTimedDetails, [&v](unsigned detail) {
                                               const auto ms = v.find(std::to_string(detail));
                                               return ms != v.end() && kPositive.fits(*ms);
                                           });
                                },
                                "milliseconds of the details 0, 1, 2 and 4"};

constexpr const char* kBounds[] = {"psnr", "temporal", "p99"};

} // namespace

bool StabilityFacts::passed() const
{
    return std::ranges::all_of(verdicts, &Verdict::passed);
}

void describe(const Record& at, UsedRange& used)
{
    at.field("mean", used.mean, kNumber);
    at.field("min", used.min, kNumber);
    at.field("max", used.max, kNumber);
}

void describe(const Record& at, TargetFacts& target)
{
    describe(at.object("lod_bias_used"), target.lod_bias);
    describe(at.object("detail_used"), target.detail);
}

void describe(const Record& at, DeviceCeilings& ceilings)
{
    at.field("copy_bytes_per_s", ceilings.copy_bytes_per_s, kPositive);
    at.field("read_bytes_per_s", ceilings.read_bytes_per_s, kPositive);
    at.field("fma_lane_ops_per_s", ceilings.fma_lane_ops_per_s, kPositive);
    at.field("exp_per_s", ceilings.exp_per_s, kPositive);
    at.field("mma_flop_per_s", ceilings.mma_flop_per_s, kPositive);
}

void describe(const Record& at, StageRoofline& stage)
{
    at.field("name", stage.name, kName);
    at.field("bytes_read", stage.bytes_read, kPositive);
    at.field("bytes_written", stage.bytes_written, kPositive);
    at.field("lane_operations", stage.lane_operations, kPositive);
    at.field("exponentials", stage.exponentials, kPositive);
    at.field("matrix_flop", stage.matrix_flop, kPositive);
    at.field("floor_ms", stage.floor_ms, kPositive);
    at.field("measured_ms", stage.measured_ms, kPositive);
    at.fieldOrNull("percent_of_ceiling", stage.percent, kPositive);
    at.fieldOrNull("bound", stage.bound, kName);
}

void describe(const Record& at, RooflineFacts& roofline)
{
    describe(at.object("ceilings"), roofline.ceilings);
    at.objects("stages", roofline.stages);
}

// A value that is no number is as bad as can be: JSON's null is that of equal pictures.
void describe(const Record& at, Verdict& verdict)
{
    if (verdict.bound == "psnr")
        verdict.value = boundedPsnr(verdict.value);
    else
        verdict.value = std::abs(verdict.value) < kWorstError ? verdict.value : kWorstError;
    at.field("limit", verdict.limit, kNumber);
    at.fieldOrNull("value", verdict.value, kNumber, std::numeric_limits<double>::infinity());
    at.field("frame", verdict.frame, kCount);
    at.field("passed", verdict.passed, kFlag);
}

void describe(const Record& at, WorkerFacts& worker)
{
    at.field("device", worker.device, kName);
    at.field("name", worker.name, kText);
    at.field("state", worker.state, kName);
    at.field("parts", worker.parts, kCount);
    at.field("busy_ms", worker.busy_ms, kPositive);
    at.field("load_ms", worker.load_ms, kPositive);
    at.field("starts", worker.starts, kCount);
    at.field("stops", worker.stops, kCount);
    at.field("faults", worker.faults, kCount);
    at.fieldOrNull("last_fault", worker.last_fault, kText);
}

void describe(const Record& at, ServiceFacts::Wire& wire)
{
    at.field("bytes", wire.bytes, kCount);
    at.field("picture_bytes", wire.picture_bytes, kCount);
}

void describe(const Record& at, MedianRange& range)
{
    at.field("low", range.low, kPositive);
    at.field("high", range.high, kPositive);
}

void describe(const Record& at, WorkFacts& work)
{
    describe(at.object("ns_per_gaussian"), work.ns_per_gaussian);
    for (size_t i = 0; i < std::size(kEyeCounts); ++i)
        describe(at.object("per_eye").object(kEyeCounts[i].name), work.per_eye[i]);
    describe(at.object("cache_bytes"), work.cache_bytes);
    describe(at.object("cache_evictions"), work.cache_evictions);
    for (size_t i = 0; i < std::size(kCoarseCounts); ++i)
        describe(at.object("coarse").object(kCoarseCounts[i].name), work.coarse[i]);
    at.field("pixels_per_frame", work.pixels_per_frame, kPositive);
    describe(at.object("passes"), work.passes);
    at.field("frames_that_grew", work.frames_that_grew, kCount);
    at.field("frames_repeated", work.frames_repeated, kCount);
    at.field("repeat_ms", work.repeat_ms, kPositive);
    at.field("most_repeat_ms", work.most_repeat_ms, kPositive);
    at.part("wall_median", work.wall_median);
    at.part("target", work.target);
    at.part("roofline", work.roofline);
}

void describe(const Record& at, StabilityFacts& stability)
{
    bool passed = stability.passed();
    at.field("passed", passed, kFlag);
    for (const char* bound : kBounds) {
        const auto found = std::ranges::find(stability.verdicts, bound, &Verdict::bound);
        const bool known = found != stability.verdicts.end();
        if (at.hasPart(bound, known))
            describe(at.object(bound), known ? *found : stability.verdicts.emplace_back(Verdict{bound}));
    }
    at.check("passed", passed == stability.passed(), "what the verdicts say together");
}

void describe(const Record& at, CurveFacts& curve)
{
    at.fieldOrNull("target_psnr", curve.target_psnr, kPositive, -1.0);
    at.field("model_anchors", curve.model_anchors, kCount);
    at.field("most_pixels", curve.most_pixels, kCount);
    at.field("archive_bytes", curve.archive_bytes, kCount);
    at.field("worst_pose", curve.worst_pose, kText);
    OrderedJson times = OrderedJson::object(); // written as one value: a path with the field "0" would make an array
    for (size_t i = 0; i < std::size(kTimedDetails); ++i)
        times[std::to_string(kTimedDetails[i])] = curve.detail_ms[i];
    at.field("detail_ms", times, kDetailTimes);
    for (size_t i = 0; i < std::size(kTimedDetails); ++i)
        curve.detail_ms[i] = times[std::to_string(kTimedDetails[i])].get<double>();
}

void describe(const Record& at, ServiceFacts& service)
{
    at.field("mode", service.mode, kName);
    at.field("sharing", service.sharing, kCount);
    at.fieldOrNull("cause", service.cause, kText);
    if (at.hasObject("wire", service.wire.has_value())) {
        if (!service.wire)
            service.wire = ServiceFacts::Wire{}; // note: clang 14 does not take emplace() here
        describe(at.object("wire"), *service.wire);
    }
    at.objects("list", service.list);
}

} // namespace gsc
