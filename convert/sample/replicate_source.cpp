// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/replicate_source.h"

#include "convert/bake/grid_fit.h"
#include "format/error.h"
#include "format/interrupt.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>

namespace gsc {

namespace {

constexpr size_t kBatch = 65'536;
constexpr double kNear = 0.2; // upstream's near plane

bool sees(const SourceCamera& c, Vec3 p)
{
    const double d[3] = {p.x - c.position[0], p.y - c.position[1], p.z - c.position[2]};
    double view[3];
    for (int i = 0; i < 3; ++i)
        view[i] = c.rotation[i] * d[0] + c.rotation[3 + i] * d[1] + c.rotation[6 + i] * d[2];
    return view[2] > kNear && std::abs(view[0]) * c.fx <= view[2] * 0.5 * c.width &&
           std::abs(view[1]) * c.fy <= view[2] * 0.5 * c.height;
}

std::vector<const SourceCamera*> trainingCameras(const Checkpoint& checkpoint)
{
    std::vector<const SourceCamera*> cameras;
    for (const SourceCamera& c : checkpoint.cameras)
        if (!c.is_test)
            cameras.push_back(&c);
    if (cameras.size() < kMinViews)
        throw Error(ErrorCode::Usage,
                    formatString("%s: has %zu training cameras, expected at least %u in cameras.json; replicate needs "
                                 "the cameras of an aerial model to find the ground",
                                 checkpoint.model_path.c_str(), cameras.size(), kMinViews));
    return cameras;
}

bool wellSeen(const std::vector<const SourceCamera*>& cameras, Vec3 p)
{
    uint32_t views = 0;
    for (const SourceCamera* c : cameras)
        if (sees(*c, p) && ++views == kMinViews)
            return true;
    return false;
}

// Eigenvectors of a symmetric matrix by Jacobi rotations, largest eigenvalue first.
void principalAxes(double m[3][3], Vec3 axes[3])
{
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 32; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (std::abs(m[p][q]) < 1e-300)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; ++k) {
                    const double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b;
                    m[k][q] = s * a + c * b;
                }
                for (int k = 0; k < 3; ++k) {
                    const double a = m[p][k], b = m[q][k];
                    m[p][k] = c * a - s * b;
                    m[q][k] = s * a + c * b;
                    const double e = v[k][p], f = v[k][q];
                    v[k][p] = c * e - s * f;
                    v[k][q] = s * e + c * f;
                }
            }
    int order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](int a, int b) { return m[a][a] > m[b][b]; });
    for (int i = 0; i < 3; ++i) {
        const Vec3 axis{v[0][order[i]], v[1][order[i]], v[2][order[i]]};
        // a sign that does not depend on the path of the iteration
        const double largest = std::max({axis.x, axis.y, axis.z}), smallest = std::min({axis.x, axis.y, axis.z});
        axes[i] = axis * (largest >= -smallest ? 1.0 : -1.0);
    }
}

double quantile(std::vector<double>& values, double q)
{
    const auto at = values.begin() + std::ptrdiff_t(q * double(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

GroundFrame fitGround(const std::vector<Vec3>& points, const std::vector<const SourceCamera*>& cameras)
{
    GroundFrame frame;
    Vec3 mean;
    for (const Vec3& p : points)
        mean = mean + p * (1.0 / double(points.size()));
    double m[3][3] = {};
    for (const Vec3& p : points) {
        const double d[3] = {p.x - mean.x, p.y - mean.y, p.z - mean.z};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                m[i][j] += d[i] * d[j];
    }
    Vec3 axes[3];
    principalAxes(m, axes);
    Vec3 eye;
    for (const SourceCamera* c : cameras)
        eye = eye + Vec3{c->position[0], c->position[1], c->position[2]} * (1.0 / double(cameras.size()));
    frame.up = axes[2] * (dot(eye - mean, axes[2]) >= 0 ? 1.0 : -1.0);
    frame.axis[0] = axes[0];
    frame.axis[1] = cross(frame.up, axes[0]);

    std::vector<double> values(points.size());
    const auto along = [&](Vec3 axis, double q) {
        for (size_t i = 0; i < points.size(); ++i)
            values[i] = dot(points[i], axis);
        return quantile(values, q);
    };
    for (int i = 0; i < 2; ++i) {
        frame.low[i] = along(frame.axis[i], 0.1);
        frame.high[i] = along(frame.axis[i], 0.9);
    }
    frame.ground = along(frame.up, 0.5);
    std::vector<double> heights;
    for (const SourceCamera* c : cameras)
        heights.push_back(dot({c->position[0], c->position[1], c->position[2]}, frame.up) - frame.ground);
    frame.capture_height = quantile(heights, 0.5);
    return frame;
}

bool insideTile(const GroundFrame& frame, Vec3 p)
{
    for (int i = 0; i < 2; ++i) {
        const double x = dot(p, frame.axis[i]);
        if (!(x >= frame.low[i] && x < frame.high[i]))
            return false;
    }
    return dot(p, frame.up) - frame.ground < kHighestShare * frame.capture_height;
}

// One row in upstream's column order: what openAnchors() took apart.
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
        throw Error(ErrorCode::Unsupported, cp.ply_path + ": positions do not lie on a voxel grid, expected those a "
                                                          "trainer leaves; replicate needs the grid to snap copies to");
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
        throw Error(ErrorCode::Unsupported, cp.model_path + ": is neither a Scaffold-GS nor an Octree-GS model; "
                                                            "replicate writes these two layouts only");
    const std::vector<const SourceCamera*> cameras = trainingCameras(cp);
    const auto anchors = openAnchors(cp);
    AnchorBatch batch;
    std::vector<Vec3> seen;
    std::vector<GridSample> samples;
    const auto point = [&](size_t i) {
        return Vec3{batch.position[3 * i], batch.position[3 * i + 1], batch.position[3 * i + 2]};
    };
    while (anchors->next(batch, kAnchorPlacement, kBatch)) {
        throwIfInterrupted();
        for (size_t i = 0; i < batch.count; ++i) {
            for (int axis = 0; axis < 3; ++axis)
                samples.push_back({batch.position[3 * i + size_t(axis)], batch.level[i]});
            if (wellSeen(cameras, point(i)))
                seen.push_back(point(i));
        }
    }
    if (seen.size() < 100)
        throw Error(ErrorCode::Usage, formatString("%s: %zu anchors are seen by %u training cameras, expected at least "
                                                   "100; replicate needs a model of the ground from the air",
                                                   cp.model_path.c_str(), seen.size(), kMinViews));
    ReplicateSource source;
    source.octree = cp.family == ModelFamily::OctreeGs;
    source.row_floats = 3 + 3 + 3 * cp.n_offsets + cp.feat_dim + 1 + 6 + 4;
    source.frame = fitGround(seen, cameras);
    if (!(source.frame.capture_height > 0))
        throw Error(ErrorCode::Usage, cp.model_path + ": the cameras are not above the ground; replicate needs a model "
                                                      "photographed from the air");
    anchors->rewind();
    while (anchors->next(batch, kAnchorAll, kBatch)) {
        throwIfInterrupted();
        for (size_t i = 0; i < batch.count; ++i) {
            const Vec3 p = point(i);
            if (!insideTile(source.frame, p) || !wellSeen(cameras, p))
                continue;
            appendRow(cp, batch, i, source.rows);
            source.anchors.push_back({batch.level[i], {}});
        }
    }
    if (source.anchors.empty())
        throw Error(ErrorCode::Usage, cp.model_path + ": no anchor lies within the ground tile; is it an aerial model");
    locate(cp, samples, source);
    return source;
}

} // namespace gsc
