// SPDX-License-Identifier: Apache-2.0
#include "runtime/records/run_row.h"

#include <gsc/error.h>
#include "runtime/records/score_options.h"

#include <algorithm>
#include <limits>
#include <tuple>

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
const FieldKind kCounts = {[](const OrderedJson& v) { return v.is_array() && std::ranges::all_of(v, kCount.fits); },
                           "an array of whole numbers"};

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

void describe(const Record& at, RowConfig& config)
{
    at.field("id", config.id, kName);
    at.field("trajectory", config.trajectory, kName);
    at.field("cameras", config.cameras, kText);
    at.field("frames", config.frames, kCount);
    at.check("frames", config.frames >= 1 && config.frames <= kMaxFrames, "a whole number from 1 to 10000000");
    at.field("warmup", config.warmup, kCount);
    at.field("cold", config.cold, kFlag);
    describe(at, config.reuse);
    for (const char* cache : {"cut", "order"}) // without them a row of an earlier version would pass for a plain run
        at.checkOff(cache, "false: this version has no such cache");
    at.field("tier", config.tier, kName);
    at.field("lod_bias", config.lod_bias, kNumber);
    if (at.has("lod_fade"))
        at.field("lod_fade", config.lod_fade, kNumber);
    if (at.has("lod_hysteresis"))
        at.field("lod_hysteresis", config.lod_hysteresis, kNumber);
    if (at.has("detail"))
        at.field("detail", config.detail, kPositive);
    if (at.has("fovea_pixels"))
        at.fieldOrNull("fovea_pixels", config.fovea_pixels, kPositive);
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
    if (at.has("scored")) { // rows of earlier versions score all
        const Record scored = at.object("scored");
        scored.field("first", accuracy.first_frame, kCount);
        scored.field("every", accuracy.every_frame, kCount);
        scored.check("every", accuracy.every_frame >= 1, "a whole number of at least 1");
    }
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
    if (at.has("motion"))
        describeChanges(at, "motion", accuracy.motion, false);
    if (at.has("pop"))
        describeChanges(at, "pop", accuracy.pop, false);
    if (at.has("error_pop"))
        describeChanges(at, "error_pop", accuracy.error_pop, false);
    if (at.hasPart("fovea", accuracy.fovea.has_value()))
        describe(at.object("fovea"), accuracy.fovea ? *accuracy.fovea : accuracy.fovea.emplace());
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
    std::string schema = "gsc.run/1";
    at.field("schema", schema, kName);
    describe(at.object("tool"), row.tool);
    at.field("label", row.label, kText);
    describe(at.object("file"), row.file);
    if (at.hasPart("reference_file", row.reference_file.has_value()))
        describe(at.object("reference_file"), row.reference_file ? *row.reference_file : row.reference_file.emplace());
    at.field("backend", row.backend, kName);
    if (at.has("reference"))
        at.field("reference", row.reference, kText);
    describe(at.object("device"), row.device);
    describe(at.object("config"), row.config);
    if (at.has("rendered_tier"))
        at.field("rendered_tier", row.rendered_tier, kName);
    else
        row.rendered_tier = row.config.tier;
    describe(at.object("ms"), row.ms);
    describe(at.object("accuracy"), row.accuracy);
    describe(at.object("reuse"), row.reuse);
    at.field("peak_bytes", row.peak_bytes, kCount);
    if (at.has("repeats"))
        at.field("repeats", row.repeats, kCount);

    const Record frames = at.object("per_frame");
    std::ranges::transform(row.accuracy.frame_psnr, row.accuracy.frame_psnr.begin(), boundedPsnr);
    frames.series("wall_ms", row.wall_ms, 0);
    frames.check("wall_ms", !row.wall_ms.empty(), "an array that is not empty");
    frames.series("psnr", row.accuracy.frame_psnr, kInfinity);
    frames.series("temporal", row.accuracy.frame_temporal, std::numeric_limits<double>::quiet_NaN());
    frames.field("decoded", row.decoded, kCounts);
    const size_t drawn = row.wall_ms.size();
    const size_t scored = ScoreOptions{0, 0, row.accuracy.every_frame, row.accuracy.first_frame}.scoredOf(drawn);
    const std::tuple<const char*, size_t, size_t> lengths[] = {{"psnr", row.accuracy.frame_psnr.size(), scored},
                                                               {"temporal", row.accuracy.frame_temporal.size(), scored},
                                                               {"decoded", row.decoded.size(), drawn}};
    for (const auto& [key, length, expected] : lengths)
        frames.check(key, length == expected, formatString("an array of %zu values", expected));
    if (at.hasPart("shard", row.shard.has_value())) // last, so that merged rows have the order of plain ones
        describe(at.object("shard"), row.shard ? *row.shard : row.shard.emplace());
}

} // namespace gsc
