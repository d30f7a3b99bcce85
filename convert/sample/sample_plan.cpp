// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/sample_plan.h"

#include <gsc/interrupt.h>

namespace gsc {

namespace {

uint32_t levelCount(const SampleOptions& options)
{
    if (options.model == SampleModel::Scaffold || options.anchors < 50)
        return 1;
    return options.anchors < 2000 ? 2 : options.anchors < 600'000 ? 3 : options.anchors < 6'000'000 ? 4 : 5;
}

// Number of anchors, not rounded, that `surface` gets on a level.
double levelWeight(const SamplePlan& plan, const Surface& surface, uint32_t level)
{
    const double weight = plan.weight_of[size_t(surface.share)] * surfaceArea(surface) * surface.density;
    if (surface.all_levels)
        return weight * plan.level_share[level];
    return level == 0 ? weight : 0;
}

uint64_t boundary(const SamplePlan& plan, double anchors)
{
    return std::min(plan.anchors, uint64_t(std::max(0.0, std::floor(anchors))));
}

} // namespace

SamplePlan planSample(const SampleOptions& options)
{
    SamplePlan plan;
    plan.spec = planScene(options.scene, options.anchors, options.seed);
    plan.anchors = options.anchors;
    plan.levels = levelCount(options);
    double sum = 0;
    for (uint32_t level = 0; level < plan.levels; ++level)
        sum += plan.level_share[level] = std::exp2(2.0 * level);
    for (double& share : plan.level_share)
        share /= sum;

    double area[size_t(AnchorShare::Count)] = {}, densest_main = 0, densest_single = 0;
    const auto for_each_tile = [&](const auto& visit) {
        SceneTile tile;
        for (uint32_t i = 0; i < plan.spec.tile_count; ++i) {
            throwIfInterrupted();
            buildTile(plan.spec, i, tile);
            visit(tile.surfaces);
        }
    };
    for_each_tile([&](const std::vector<Surface>& surfaces) {
        for (const Surface& s : surfaces)
            area[size_t(s.share)] += surfaceArea(s) * s.density;
    });
    double shares = 0;
    for (size_t i = 0; i < size_t(AnchorShare::Count); ++i)
        shares += area[i] > 0 ? plan.spec.share[i] : 0;
    for (size_t i = 0; i < size_t(AnchorShare::Count); ++i)
        plan.weight_of[i] = area[i] > 0 ? plan.spec.share[i] / shares / area[i] * double(options.anchors) : 0;

    plan.tile_start.assign(1, 0);
    for_each_tile([&](const std::vector<Surface>& surfaces) {
        double anchors = plan.tile_start.back();
        for (const Surface& s : surfaces) {
            double& densest = s.all_levels ? densest_main : densest_single;
            densest = std::max(densest, plan.weight_of[size_t(s.share)] * s.density);
            for (uint32_t level = 0; level < plan.levels; ++level)
                anchors += levelWeight(plan, s, level);
        }
        plan.tile_start.push_back(anchors);
    });
    // metres between neighbours on the finest level where anchors are densest
    const double finest = 1 / std::sqrt(densest_main * plan.level_share[plan.levels - 1]);

    // anchors that are 2.2 cells apart never fall into one cell, even if the cells of a surface are not quite square
    constexpr double kCellsApart = 2.2;
    const double extent = std::max({plan.spec.half_extent, plan.spec.horizon, 1.0});
    if (options.model == SampleModel::Scaffold) {
        plan.grid = scaffoldGrid(finest / 4);
    } else {
        double spacing = finest * std::exp2(double(plan.levels - 1));
        if (densest_single > 0)
            spacing = std::min(spacing, 1 / std::sqrt(densest_single));
        plan.grid = octreeGrid(float(-extent), float(extent), spacing / kCellsApart, plan.levels);
        // distance at which a level changes to the next: its Gaussians are then 2 pixels apart (focal length 1024
        // pixels)
        const double main_weight = plan.weight_of[size_t(AnchorShare::Main)];
        const double gaussians = 1 / std::sqrt(10 * main_weight * plan.level_share[0]);
        plan.standard_dist = float(1024.0 / 2 * std::sqrt(2.0) * gaussians);
    }
    return plan;
}

uint64_t tileFirst(const SamplePlan& plan, uint32_t tile)
{
    return tile == plan.spec.tile_count ? plan.anchors : boundary(plan, plan.tile_start[tile]);
}

std::vector<SurfaceShare> shareTile(const SamplePlan& plan, uint32_t tile, const SceneTile& content)
{
    std::vector<SurfaceShare> shares;
    const uint64_t end = tileFirst(plan, tile + 1);
    uint64_t first = tileFirst(plan, tile);
    double anchors = plan.tile_start[tile];
    for (uint32_t i = 0; i < content.surfaces.size(); ++i)
        for (uint32_t level = 0; level < plan.levels; ++level) {
            anchors += levelWeight(plan, content.surfaces[i], level);
            const uint64_t last = std::min(end, boundary(plan, anchors));
            if (last > first)
                shares.push_back({i, level, first, last});
            first = std::max(first, last);
        }
    if (!shares.empty())
        shares.back().last = end; // rounding can leave one anchor over
    else if (end > first)
        shares.push_back({0, 0, first, end});
    return shares;
}

} // namespace gsc
