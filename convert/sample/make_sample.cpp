// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/sample.h"

#include "convert/input/torch/torch_archive.h"
#include "convert/sample/model/model_folder.h"
#include "convert/sample/model/model_text.h"
#include "convert/sample/paths/site_paths.h"
#include "convert/sample/sample_plan.h"
#include "convert/sample/scenes/lighting.h"
#include "convert/sample/scenes/surface_rows.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "format/machine/machine.h"
#include "kernels/threads/tbb_bound.h"

#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

namespace gsc {

namespace {

// most anchors made at once of a tile without bounds; such a tile may be cut anywhere
constexpr uint64_t kSliceAnchors = 65'536;

const char* sceneName(SampleScene scene)
{
    return scene == SampleScene::City ? "city" : scene == SampleScene::Street ? "street" : "room";
}

// Anchors [first, last) of a tile, made at once.
struct Slice {
    uint32_t tile;
    uint64_t first, last;
    std::vector<float> rows;
};

std::vector<Slice> sliceTiles(const SamplePlan& plan)
{
    std::vector<Slice> slices;
    for (uint32_t tile = 0; tile < plan.spec.tile_count; ++tile) {
        const uint64_t end = tileFirst(plan, tile + 1);
        uint64_t first = tileFirst(plan, tile);
        const bool whole = tile < plan.spec.main_tiles;
        while (first < end) {
            const uint64_t last = whole ? end : std::min(end, first + kSliceAnchors);
            slices.push_back({tile, first, last, {}});
            first = last;
        }
    }
    return slices;
}

void fillSlice(const SamplePlan& plan, SampleModel model, Slice& slice)
{
    throwIfInterrupted();
    SceneTile content;
    buildTile(plan.spec, slice.tile, content);
    addNeighbourOccluders(plan.spec, slice.tile, content);
    SurfaceRows rows(plan.spec, plan.grid, model, content);
    rows.rows().reserve((slice.last - slice.first) * kSampleRowFloats);
    for (const SurfaceShare& share : shareTile(plan, slice.tile, content)) {
        const uint64_t first = std::max(share.first, slice.first), last = std::min(share.last, slice.last);
        if (first >= last)
            continue;
        throwIfInterrupted();
        const Surface& surface = content.surfaces[share.surface];
        const CellLayout layout = layoutCells(surface, share.last - share.first);
        rows.add(surface, share.level, layout, first - share.first, last - share.first);
    }
    slice.rows = std::move(rows.rows());
}

void writeAnchors(const SamplePlan& plan, SampleModel model, const NewFolder& folder, const std::string& ply,
                  const SampleProgress& progress)
{
    std::vector<Slice> slices = sliceTiles(plan);
    size_t next = 0;
    uint64_t written = 0;
    const auto take = [&](tbb::flow_control& control) -> Slice* {
        if (next < slices.size())
            return &slices[next++];
        control.stop();
        return nullptr;
    };
    const auto fill = [&](Slice* slice) {
        fillSlice(plan, model, *slice);
        return slice;
    };
    const auto write = [&](Slice* slice) {
        float* rows = slice->rows.data();
        for (uint64_t i = slice->first; model == SampleModel::Octree && i < std::min<uint64_t>(slice->last, 2); ++i)
            rows[(i - slice->first) * kSampleRowFloats + 5] = i == 0 ? plan.grid.quantum[0] : plan.standard_dist;
        folder.append(ply, std::as_bytes(std::span(slice->rows)));
        std::vector<float>().swap(slice->rows);
        written = slice->last;
        if (progress)
            progress("anchors", written, plan.anchors);
    };
    tbb::task_arena arena(boundTbb() ? 1 : usableProcessors());
    arena.execute([&] {
        tbb::parallel_pipeline(size_t(arena.max_concurrency()) * 2,
                               tbb::make_filter<void, Slice*>(tbb::filter_mode::serial_in_order, take) &
                                   tbb::make_filter<Slice*, Slice*>(tbb::filter_mode::parallel, fill) &
                                   tbb::make_filter<Slice*, void>(tbb::filter_mode::serial_in_order, write));
    });
}

// Names the cameras and orders them as the trainers do: every eighth photograph is a test picture, and those come
// first.
std::vector<SourceCamera> namedCameras(const SceneSpec& spec)
{
    std::vector<SourceCamera> cameras = sceneCameras(spec);
    for (size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].name = formatString("DJI_%04zu", i + 1);
        cameras[i].is_test = i % 8 == 0;
    }
    std::stable_partition(cameras.begin(), cameras.end(), [](const SourceCamera& camera) { return camera.is_test; });
    return cameras;
}

void writeWeights(const NewFolder& folder, const std::string& iteration, const SampleOptions& options,
                  const SamplePlan& plan, uint32_t appearance_rows)
{
    SampleInputs inputs;
    const bool octree = options.model == SampleModel::Octree;
    inputs.feature_bank = inputs.distance = options.everything_on;
    inputs.bank_distance = options.everything_on && !octree;
    inputs.bank_level = inputs.level = options.everything_on && octree;
    inputs.appearance = options.everything_on ? kSampleAppearance : 0;
    inputs.distance_unit = float(std::max(plan.spec.horizon, 2 * plan.spec.half_extent));
    // direction in which a viewer looks at water that mirrors the sun
    const dvec3 sun = sunDirection(options.scene);
    const float glint[3] = {float(sun.x), float(sun.y), float(-sun.z)};
    static constexpr const char* kNames[] = {"opacity_mlp", "cov_mlp", "color_mlp", "feature_bank_mlp"};
    const std::vector<Mlp> mlps = sampleMlps(inputs, glint);
    for (size_t i = 0; i < mlps.size(); ++i)
        folder.append(iteration + kNames[i] + ".pt", writeTorchScriptMlp(mlps[i], kNames[i]));
    if (inputs.appearance)
        folder.append(iteration + "embedding_appearance.pt",
                      writeTorchScriptEmbedding(sampleEmbedding(appearance_rows, options.seed), appearance_rows,
                                                kSampleAppearance, "embedding_appearance"));
}

PathSite pathSite(const SampleOptions& options, const SamplePlan& plan)
{
    PathSite site;
    site.axis[0] = {1, 0, 0};
    site.axis[1] = {0, 1, 0};
    site.up = {0, 0, 1};
    const double half = plan.spec.half_extent;
    site.high[0] = site.high[1] = half;
    site.view_height = std::clamp(0.6 * half, 40.0, 200.0);
    if (options.scene == SampleScene::Street) {
        site.high[1] = 7.0; // between the facades
        site.view_height = 14;
    } else if (options.scene == SampleScene::Room) {
        site.high[0] = kRoomHalf.x;
        site.high[1] = kRoomHalf.y;
        site.view_height = 0.85 * kRoomHeight;
    }
    for (int i = 0; i < 2; ++i)
        site.low[i] = -site.high[i];
    if (options.model == SampleModel::Octree) {
        // the level rule that octreeArguments() writes into cfg_args
        site.level_rule = options.everything_on ? LevelRule::Floor : LevelRule::Round;
        site.standard_dist = double(plan.standard_dist);
        site.finest_level = int32_t(plan.levels) - 1;
    }
    return site;
}

} // namespace

SampleReport makeSample(const SampleOptions& options, const SampleProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    const bool octree = options.model == SampleModel::Octree;
    const uint64_t least = octree ? 2 : 1; // an Octree-GS file stores two numbers of the model in its first two rows
    if (options.anchors < least || options.anchors > kMaxAnchors)
        throw Error(ErrorCode::Usage, formatString("--anchors %llu", static_cast<unsigned long long>(options.anchors)),
                    "out of range",
                    formatString("%llu to %llu", static_cast<unsigned long long>(least),
                                 static_cast<unsigned long long>(kMaxAnchors)),
                    "pass another number");
    NewFolder folder(options.output, options.overwrite, kModelFolder);
    const SamplePlan plan = planSample(options);

    TrainingArguments arguments;
    arguments.scene = sceneName(options.scene);
    arguments.everything_on = options.everything_on;
    arguments.appearance_dim = options.everything_on ? kSampleAppearance : 0;
    arguments.voxel_size = plan.grid.voxel_decimal;
    arguments.base_layer = plan.grid.base_layer;
    folder.append("cfg_args", octree ? octreeArguments(arguments) : scaffoldArguments(arguments));
    const std::vector<SourceCamera> cameras = namedCameras(plan.spec);
    const auto trained = std::count_if(cameras.begin(), cameras.end(), [](const auto& c) { return !c.is_test; });
    folder.append("cameras.json", camerasJson(cameras));
    const PathSite site = pathSite(options, plan);
    folder.append(kMetreFile, metreFileText({site.metre, "the scene was made in metres"}));
    writeSitePaths(folder, sitePaths(site));

    const std::string iteration = octree ? "point_cloud/iteration_40000/" : "point_cloud/iteration_30000/";
    writeWeights(folder, iteration, options, plan, uint32_t(trained));
    const std::string ply = iteration + "point_cloud.ply";
    folder.append(ply, plyHeader(options.anchors, octree, kSampleFeatures, kSampleOffsets));
    writeAnchors(plan, options.model, folder, ply, progress);
    throwIfInterrupted();

    SampleReport report;
    report.anchors = options.anchors;
    report.ply_bytes = std::filesystem::file_size(folder.file(ply));
    folder.commit();
    report.path_file = (std::filesystem::path(options.output) / kFirstPath).string();
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

} // namespace gsc
