// SPDX-License-Identifier: Apache-2.0
#include <gsc/frame_stats.h>

#include <nlohmann/json.hpp>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;

Json countsJson(const EyeCounts& counts, uint64_t pixels)
{
    return {
        {"groups_tested", counts.groups_tested},
        {"anchors_tested", counts.anchors_tested},
        {"anchors_visible", counts.anchors_visible},
        {"anchors_decoded", counts.anchors_decoded},
        {"anchors_reused", counts.anchors_reused},
        {"anchors_overdue", counts.anchors_overdue},
        {"gaussians_alive", counts.gaussians_alive},
        {"gaussians_visible", counts.gaussians_visible},
        {"gaussians_dropped", counts.gaussians_dropped},
        {"pairs", counts.pairs},
        {"blend_evaluations", counts.blend_evaluations},
        {"blend_evaluations_per_pixel", pixels > 0 ? double(counts.blend_evaluations) / double(pixels) : 0.0},
    };
}

} // namespace

const char* tierName(Tier tier)
{
    return tier == Tier::Exact ? "exact" : "fast";
}

std::string frameStatsJson(const FrameStats& stats)
{
    const FrameResult& result = stats.result;
    Json eyes = Json::array();
    for (uint32_t eye = 0; eye < stats.eye_count && eye < kMaxEyes; ++eye)
        eyes.push_back(countsJson(result.eyes[eye], uint64_t(stats.width) * stats.height));
    const Json json = {
        {"schema", "gsc.frame-stats/1"},
        {"frame", stats.frame},
        {"camera", stats.camera},
        {"backend", stats.backend},
        {"tier", tierName(stats.tier)},
        {"width", stats.width},
        {"height", stats.height},
        {"appearance", stats.appearance < 0 ? Json() : Json(stats.appearance)},
        {"ms",
         {{"select", result.times.select},
          {"decode", result.times.decode},
          {"project", result.times.project},
          {"bin", result.times.bin},
          {"sort", result.times.sort},
          {"blend", result.times.blend},
          {"total", result.times.total}}},
        {"repeats", result.repeats},
        {"repeat_ms", result.repeat_ms},
        {"lod_bias", stats.lod_bias},
        {"detail", stats.detail},
        {"groups_near", result.coarse.near},
        {"groups_kept", result.coarse.kept},
        {"groups_stale", result.coarse.stale},
        {"groups_made", result.coarse.made},
        {"bytes_resident", result.bytes_resident},
        {"cache_bytes", result.cache_bytes},
        {"cache_evictions", result.cache_evictions},
        {"eyes", std::move(eyes)},
    };
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

} // namespace gsc
