// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/replicate_source.h"

#include "format/numbers/count_text.h"
#include "convert/survey/grid_fit.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace gsc {

namespace {

constexpr size_t kBatch = 65'536;

std::vector<SourceCamera> trainingCameras(const Checkpoint& checkpoint)
{
    std::vector<SourceCamera> cameras = checkpoint.cameras;
    std::erase_if(cameras, [](const SourceCamera& camera) { return camera.is_test; });
    if (cameras.size() < kMinViews)
        throw Error(ErrorCode::Usage, checkpoint.model_path, formatString("has %zu training cameras", cameras.size()),
                    formatString("at least %u in cameras.json", kMinViews),
                    "replicate needs the cameras of an aerial model to find the ground");
    return cameras;
}

bool insideTile(const GroundFrame& frame, dvec3 p)
{
    for (int i = 0; i < 2; ++i) {
        const double x = dot(p, frame.axis[i]);
        if (!(x >= frame.low[i] && x < frame.high[i]))
            return false;
    }
    return dot(p, frame.up) - frame.ground < kHighestShare * frame.view_height;
}

// Appends the row of an anchor in the column order of the trainers' PLY; openAnchors() had split it into arrays.
void appendRow(const Checkpoint& cp, const AnchorBatch& b, size_t i, std::vector<float>& rows)
{
    const bool octree = cp.family == ModelFamily::OctreeGs;
    const uint32_t K = cp.n_offsets, F = cp.feat_dim;
    rows.insert(rows.end(), &b.position[3 * i], &b.position[3 * i] + 3);
    if (octree) {
        rows.insert(rows.end(), {float(b.level[i]), b.extra_level[i], 0.0f});
    } else {
        rows.insert(rows.end(), &b.normal[3 * i], &b.normal[3 * i] + 3);
    }
    for (uint32_t axis = 0; axis < 3; ++axis)
        for (uint32_t k = 0; k < K; ++k)
            rows.push_back(b.offset[(i * K + k) * 3 + axis]);
    rows.insert(rows.end(), &b.feature[size_t(F) * i], &b.feature[size_t(F) * i] + F);
    rows.push_back(b.opacity[i]);
    rows.insert(rows.end(), &b.scale[6 * i], &b.scale[6 * i] + 6);
    rows.insert(rows.end(), &b.rotation[4 * i], &b.rotation[4 * i] + 4);
}

void locate(const Checkpoint& cp, const std::vector<GridSample>& all, ReplicateSource& source)
{
    std::vector<GridSample> samples = all;
    const GridHints hints{cp.voxel_size, cp.fork, source.octree};
    const std::optional<Grid> grid = fitGrid(samples, hints);
    const auto refuse = [&] {
        throw Error(ErrorCode::Unsupported, cp.ply_path, "positions do not lie on a voxel grid",
                    "those a trainer leaves", "replicate needs the grid to snap copies to");
    };
    if (!grid)
        refuse();
    source.origin = grid->origin;
    for (int32_t level = 0; level < int32_t(kMaxLevels); ++level)
        source.quantum.push_back(levelQuantum(grid->voxel_size, cp.fork, level));
    for (size_t i = 0; i < source.anchors.size(); ++i) {
        TileAnchor& anchor = source.anchors[i];
        for (int axis = 0; axis < 3; ++axis) {
            const auto point = locateOnGrid(source.rows[i * source.row_floats + size_t(axis)],
                                            source.quantum[size_t(anchor.level)], source.origin);
            if (!point)
                refuse();
            anchor.quanta[axis] = point->quanta;
        }
    }
}

} // namespace

ReplicateSource readReplicateSource(const Checkpoint& cp)
{
    if (cp.family != ModelFamily::ScaffoldGs && cp.family != ModelFamily::OctreeGs)
        throw Error(ErrorCode::Unsupported, cp.model_path, "is neither a Scaffold-GS nor an Octree-GS model",
                    "one of them", "replicate writes these two layouts only");
    const std::vector<SourceCamera> cameras = trainingCameras(cp);
    const auto anchors = openAnchors(cp);
    AnchorBatch batch;
    std::vector<dvec3> seen;
    std::vector<GridSample> samples;
    const auto point = [&](size_t i) { return dvec3(glm::make_vec3(&batch.position[3 * i])); };
    while (anchors->next(batch, kAnchorPlacement, kBatch)) {
        throwIfInterrupted();
        for (size_t i = 0; i < batch.count; ++i) {
            for (int axis = 0; axis < 3; ++axis)
                samples.push_back({batch.position[3 * i + size_t(axis)], batch.level[i]});
            if (wellSeen(cameras, kMinViews, point(i)))
                seen.push_back(point(i));
        }
    }
    if (seen.size() < 100)
        throw Error(
            ErrorCode::Usage, cp.model_path,
            formatString("%s seen by %u training cameras", formatCount(seen.size(), "anchor").c_str(), kMinViews),
            "at least 100", "replicate needs a model of the ground from the air");
    ReplicateSource source;
    source.octree = cp.family == ModelFamily::OctreeGs;
    source.row_floats = 3 + 3 + 3 * cp.n_offsets + cp.feat_dim + 1 + 6 + 4;
    source.frame = fitGround(seen, cameras);
    if (!(source.frame.view_height > 0))
        throw Error(ErrorCode::Usage, cp.model_path, "the cameras are not above the ground", "them in the air",
                    "replicate needs a model photographed from the air");
    anchors->rewind();
    while (anchors->next(batch, kAnchorAll, kBatch)) {
        throwIfInterrupted();
        for (size_t i = 0; i < batch.count; ++i) {
            const dvec3 p = point(i);
            if (!insideTile(source.frame, p) || !wellSeen(cameras, kMinViews, p))
                continue;
            appendRow(cp, batch, i, source.rows);
            source.anchors.push_back({batch.level[i], {}});
        }
    }
    if (source.anchors.empty())
        throw Error(ErrorCode::Usage, cp.model_path, "no anchor lies within the ground tile", "at least one",
                    "pass an aerial model");
    locate(cp, samples, source);
    return source;
}

} // namespace gsc
