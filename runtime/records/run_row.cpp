// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/run_row.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"
#include <algorithm>
#include <limits>
#include <functional>
#include <utility>

namespace gsc {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr uint64_t kMaxFrames = 10'000'000;

const FieldKind kDecibels = {kNumber.fits, "a number, or null where max_error is 0"};
const FieldKind kSize = {[](const OrderedJson& v) {
                             return v.is_array() && v.size() == 2 &&
                                    std::ranges::all_of(v, [](const OrderedJson& side) {
                                        return kCount.fits(side) && side >= 1 && side <= 1'000'000;
                                    });
                         },
                         "width and height in pixels"};

void describePsnr(const Record& at, const char* key, double& psnr)
{
    psnr = boundedPsnr(psnr);
    at.fieldOrNull(key, psnr, kDecibels, kInfinity);
}

void describePart(const Record& in, const char* key, FoveaAccuracy::Part& part)
{
    if (!in.hasObject(key, part.share > 0))
        return;
    const Record at = in.object(key), psnr = at.object("psnr");
    at.field("share", part.share, kPositive);
    at.check("share", part.share > 0 && part.share <= 1, "a number above 0, at most 1");
    describePsnr(psnr, "pooled", part.psnr_pooled);
    describePsnr(psnr, "min", part.psnr_min);
    psnr.field("min_frame", part.psnr_min_frame, kCount);
    at.fieldOrNull("flip_mean", part.flip, kPositive, -1.0);
}

void describeError(const Record& at, const char* key, double& error)
{
    error = error < kWorstError ? error : kWorstError;
    at.field(key, error, kPositive);
}

// `nothing_alike`: the value of images that cannot be compared because a pixel is not finite.
void describeSampled(const Record& in, const char* key, Accuracy::Sampled& sampled, const char* worst,
                     double nothing_alike)
{
    if (!in.hasObject(key, sampled.frames > 0))
        return;
    const Record at = in.object(key);
    const auto score = [&](const char* name, double& value) {
        value = std::isfinite(value) ? value : nothing_alike;
        at.field(name, value, kNumber);
    };
    score("mean", sampled.mean);
    score(worst, sampled.worst);
    at.field("frames", sampled.frames, kCount);
}

void describeChanges(const Record& in, const char* key, Accuracy::Changes& changes, bool against_exact)
{
    if (!in.hasObject(key, changes.images > 0))
        return;
    changes.images = std::max<uint64_t>(changes.images, 1); // a row does not say how many
    const Record at = in.object(key);
    if (against_exact)
        describeError(at, "rms", changes.rms);
    describeError(at, "p50", changes.p50);
    if (!against_exact)
        describeError(at, "p90", changes.p90);
    describeError(at, "p99", changes.p99);
    describeError(at, "max", changes.max);
    at.field("max_frame", changes.max_frame, kCount);
}

const FieldKind kCounts = {[](const OrderedJson& v) { return v.is_array() && std::ranges::all_of(v, kCount.fits); },
                           "an array of whole numbers"};
const FieldKind kTexts = {[](const OrderedJson& v) { return v.is_array() && std::ranges::all_of(v, kText.fits); },
                          "an array of texts"};

void describe(const Record& at, RowConfig& config)
{
    at.field("id", config.id, kName);
    at.field("trajectory", config.trajectory, kName);
    at.field("cameras", config.cameras, kText);
    at.field("shots", config.shots, kCount);
    at.field("frames", config.frames, kCount);
    at.check("frames", config.frames >= 1 && config.frames <= kMaxFrames, "a whole number from 1 to 10000000");
    at.field("warmup", config.warmup, kCount);
    at.field("cold", config.cold, kFlag);
    at.field("frames_in_flight", config.frames_in_flight, kCount);
    describe(at, config.reuse);
    at.field("tier", config.tier, kName);
    at.field("lod_bias", config.lod_bias, kNumber);
    at.field("lod_fade", config.lod_fade, kNumber);
    at.field("lod_hysteresis", config.lod_hysteresis, kNumber);
    at.field("detail", config.detail, kPositive);
    at.fieldOrNull("fovea_pixels", config.fovea_pixels, kPositive);
    at.fieldOrNull("target_ms", config.target_ms, kPositive);
    at.field("stereo", config.stereo, kName);
    at.field("eyes", config.eyes, kCount);
    at.check("eyes", config.eyes == 1 || config.eyes == 2, "a whole number from 1 to 2");
    at.fieldOrNull("ipd", config.ipd, kPositive);
    at.fieldOrNull("size", config.size, kSize);
    at.fieldOrNull("fov_degrees", config.fov_degrees, kPositive);
    at.fieldOrNull("near", config.near_z, kPositive);
    at.fieldOrNull("appearance", config.appearance, kCount, -1);
    at.field("threads", config.threads, kCount);
    at.fieldOrNull("vram_budget", config.vram_budget, kCount);
}

void describeScored(const Record& at, ScoredFrames& scored)
{
    if (at.hasPart("listed", !scored.listed.empty())) {
        at.field("listed", scored.listed, kCounts);
        at.check("listed", std::ranges::is_sorted(scored.listed, std::less_equal<>()), "ascending numbers of frames");
        return;
    }
    at.field("first", scored.first, kCount);
    at.field("every", scored.every, kCount);
    at.check("every", scored.every >= 1, "a whole number of at least 1");
}

// Arrays of scores have a value for each scored frame.
void describeFrames(const Record& frames, RunRow& row)
{
    frames.series("wall_ms", row.wall_ms, 0);
    frames.check("wall_ms", row.wall_ms.size() == row.config.frames,
                 "an array of " + formatCount(row.config.frames, "value"));
    frames.field("decoded", row.decoded, kCounts);
    frames.check("decoded", row.decoded.size() == row.wall_ms.size(),
                 "an array of " + formatCount(row.wall_ms.size(), "value"));
    if (!row.accuracy)
        return;
    Accuracy& accuracy = *row.accuracy;
    std::ranges::transform(accuracy.frame_psnr, accuracy.frame_psnr.begin(), boundedPsnr);
    frames.series("psnr", accuracy.frame_psnr, kInfinity);
    frames.series("temporal", accuracy.frame_temporal, std::numeric_limits<double>::quiet_NaN());
    const size_t scored = accuracy.scored.scoredOf(row.config.shots);
    for (const auto& [key, length] :
         {std::pair("psnr", accuracy.frame_psnr.size()), std::pair("temporal", accuracy.frame_temporal.size())})
        frames.check(key, length == scored, "an array of " + formatCount(scored, "value"));
}

} // namespace

void describe(const Record& at, FrameTimes& times)
{
    describe(at.object("wall"), times.wall);
    at.object("wall").check("median", times.wall.median > 0, "a number above 0"); // a run takes time
    describe(at.object("device"), times.device);
    for (size_t i = 0; i < std::size(kStages); ++i)
        describe(at.object("stages").object(kStages[i].name), times.stages[i]);
}

void describe(const Record& at, FoveaAccuracy& accuracy)
{
    describePart(at, "inside", accuracy.inside);
    describePart(at, "outside", accuracy.outside);
}

void describe(const Record& at, Accuracy& accuracy)
{
    describeScored(at.object("scored"), accuracy.scored);
    const Record psnr = at.object("psnr");
    describePsnr(psnr, "pooled", accuracy.psnr_pooled);
    describePsnr(psnr, "p1", accuracy.psnr_p1);
    describePsnr(psnr, "min", accuracy.psnr_min);
    psnr.field("min_frame", accuracy.psnr_min_frame, kCount);
    describeError(at, "max_error", accuracy.max_error);
    // equal images have no error; p1: of many images one may differ
    psnr.check("pooled", accuracy.max_error == 0 || std::isfinite(accuracy.psnr_pooled), kDecibels.expected);
    psnr.check("min", accuracy.max_error == 0 || std::isfinite(accuracy.psnr_min), kDecibels.expected);
    at.field("over_1_255", accuracy.over_1_255, kCount);
    describeSampled(at, "ssim", accuracy.ssim, "min", 0);
    describeSampled(at, "flip", accuracy.flip, "max", 1);
    describeChanges(at, "temporal", accuracy.temporal, true);
    describeChanges(at, "motion", accuracy.motion, false);
    describeChanges(at, "pop", accuracy.pop, false);
    describeChanges(at, "error_pop", accuracy.error_pop, false);
    at.part("fovea", accuracy.fovea);
}

void describe(const Record& at, ReuseCounts& counts)
{
    describe(at.object("decoded_per_frame"), counts.decoded);
    describe(at.object("reused_per_frame"), counts.reused);
    at.field("hit_rate", counts.hit_rate, kPositive);
    at.field("overdue", counts.overdue, kCount);
    at.field("evictions", counts.evictions, kCount);
    at.field("cache_bytes", counts.cache_bytes, kCount);
}

void describe(const Record& at, RunRow& row)
{
    std::string schema = kRunSchema;
    at.field("schema", schema, kName);
    describe(at.object("tool"), row.tool);
    at.field("label", row.label, kText);
    describe(at.object("file"), row.file);
    at.part("reference_file", row.reference_file);
    at.field("backend", row.backend, kName);
    at.fieldOrNull("reference", row.reference, kText);
    describe(at.object("device"), row.device);
    describe(at.object("config"), row.config);
    at.field("rendered_tier", row.rendered_tier, kName);
    const Record ms = at.object("ms");
    ms.fieldOrNull("open", row.open_ms, kPositive);
    ms.fieldOrNull("load", row.load_ms, kPositive);
    describe(ms, row.ms);
    at.part("accuracy", row.accuracy);
    describe(at.object("reuse"), row.reuse);
    at.field("peak_bytes", row.peak_bytes, kCount);
    at.field("repeats", row.repeats, kCount);
    at.part("work", row.work);
    at.part("stability", row.stability);
    at.part("curve", row.curve);
    at.part("service", row.service);
    at.field("warnings", row.warnings, kTexts);
    describeFrames(at.object("per_frame"), row);
    at.part("shard", row.shard); // last, so that merged rows have the order of plain ones
}

} // namespace gsc
