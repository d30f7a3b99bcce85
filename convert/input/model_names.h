// SPDX-License-Identifier: Apache-2.0
// Names of the kinds and features of models in files, options and reports.
#pragma once

#include <gsc/gsc_layout.h>

#include <iterator>

namespace gsc {

// Names in the order of the values of ModelFamily, LevelRule, RasterRules and MlpKind.
constexpr const char* kFamilyNames[] = {"scaffold-gs", "scaffold-gs-v1", "octree-gs", "octree-anygs"};
constexpr const char* kLevelRuleNames[] = {"none", "floor", "round", "ceil", "progressive"};
constexpr const char* kRasterRulesNames[] = {"diff-gaussian", "gsplat"};
// names of the trainers' files
constexpr const char* kMlpNames[] = {"opacity_mlp", "cov_mlp", "color_mlp", "feature_bank_mlp"};
static_assert(std::size(kFamilyNames) == uint32_t(ModelFamily::OctreeAnyGs) + 1);
static_assert(std::size(kLevelRuleNames) == uint32_t(LevelRule::Progressive) + 1);
static_assert(std::size(kRasterRulesNames) == uint32_t(RasterRules::Gsplat) + 1);
static_assert(std::size(kMlpNames) == uint32_t(MlpKind::FeatureBank) + 1);

} // namespace gsc
