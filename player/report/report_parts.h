// SPDX-License-Identifier: Apache-2.0
// What several reports of the player say in the same words.
#pragma once

#include "player/tool/json.h"
#include "runtime/renderer.h"

#include <string>
#include <vector>

namespace gsc {

// Order statistics by nearest rank.
struct Spread {
    double mean = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};

// Zeros for no values.
Spread spreadOf(std::vector<double> values);

// The q-quantile by nearest rank, q in (0, 1]. Precondition: at least one value, ascending.
double nearestRank(const std::vector<double>& sorted, double q);

OrderedJson spreadJson(const Spread& spread);
OrderedJson unknownIfZero(double value); // null for 0
OrderedJson toolJson();                  // name, version, commit
OrderedJson deviceJson(const DeviceFacts& device);
OrderedJson fileJson(const std::string& path, uint64_t bytes, uint64_t anchors);
OrderedJson reuseJson(const ReuseOptions& reuse); // null where the policy takes no such number

// How levels were chosen.
struct LodFacts {
    double bias = 0, fade = 0, hysteresis = 0; // levels
    double target_ms = 0;                      // 0 = none
    std::vector<double> used;                  // bias of each frame
};
// "lod_bias", "lod_fade", "lod_hysteresis", and "target_ms" and "lod_bias_used", null without a target.
OrderedJson lodJson(const LodFacts& lod);
std::string targetText(const LodFacts& lod); // a line; empty without a target

} // namespace gsc
