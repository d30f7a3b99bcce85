// SPDX-License-Identifier: Apache-2.0
// A model moved along its own grid, as the file of a city far from the world's origin would hold it.
#pragma once

#include "kernels/math/anchor.h"
#include <gsc/camera.h>
#include "tests/kernels/synthetic_model.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gsc::test {

// Every anchor of a model with grid positions moved by the same number of cells of level 0: in integers the same shape to
// the last bit. Bounds are those of the positions the trainer's arithmetic makes of the integers, as a bake stores them.
// `model` must outlive it. Precondition: fork 2, whose levels share their cells' corners exactly.
class MovedModel {
public:
    MovedModel(const ModelView& model, const int32_t (&cells)[3])
        : m_params(*model.params), m_levels(model.levels, model.levels + m_params.level_count),
          m_chunks(model.chunks, model.chunks + m_params.chunk_count),
          m_groups(model.groups, model.groups + m_params.group_count), m_view(model)
    {
        for (int a = 0; a < 3; ++a)
            m_by[a] = double(cells[a]) * double(m_params.voxel_size);
        m_view.params = &m_params;
        m_view.levels = m_levels.data();
        m_view.chunks = m_chunks.data();
        m_view.groups = m_groups.data();
        for (ChunkRecord& chunk : m_chunks)
            for (int a = 0; a < 3; ++a)
                chunk.origin[a] += cells[a] << m_levels[chunk.level_index].level;
        for (ChunkRecord& chunk : m_chunks)
            bound(chunk, uint32_t(&chunk - m_chunks.data()), 0, chunk.anchor_count);
        for (GroupRecord& group : m_groups)
            bound(group, group.chunk, group.anchor_first - m_chunks[group.chunk].anchor_first, group.anchor_count);
        boundLevels();
    }
    MovedModel(const MovedModel&) = delete;
    MovedModel& operator=(const MovedModel&) = delete;

    [[nodiscard]] const ModelView& view() const { return m_view; }
    [[nodiscard]] const double (&by() const)[3] { return m_by; } // world units

private:
    template <typename Record>
    void bound(Record& record, uint32_t chunk, uint32_t first, uint32_t count) const
    {
        for (int a = 0; a < 3; ++a) {
            record.gaussian_min[a] += float(m_by[a]);
            record.gaussian_max[a] += float(m_by[a]);
        }
        for (uint32_t i = first; i < first + count; ++i) {
            const Vec3<float> p = anchorPosition(m_view, chunk, i);
            const float at[3] = {p.x, p.y, p.z};
            for (int a = 0; a < 3; ++a) {
                record.anchor_min[a] = i == first ? at[a] : std::min(record.anchor_min[a], at[a]);
                record.anchor_max[a] = i == first ? at[a] : std::max(record.anchor_max[a], at[a]);
            }
        }
    }

    void boundLevels()
    {
        const auto join = [](float* low, float* high, const ChunkRecord& chunk, bool first) {
            for (int a = 0; a < 3; ++a) {
                low[a] = first ? chunk.anchor_min[a] : std::min(low[a], chunk.anchor_min[a]);
                high[a] = first ? chunk.anchor_max[a] : std::max(high[a], chunk.anchor_max[a]);
            }
        };
        for (size_t c = 0; c < m_chunks.size(); ++c) {
            const uint32_t at = m_chunks[c].level_index;
            join(m_levels[at].bounds_min, m_levels[at].bounds_max, m_chunks[c],
                 c == 0 || m_chunks[c - 1].level_index != at);
            join(m_params.bounds_min, m_params.bounds_max, m_chunks[c], c == 0);
        }
    }

    ModelParams m_params;
    std::vector<LevelRecord> m_levels;
    std::vector<ChunkRecord> m_chunks;
    std::vector<GroupRecord> m_groups;
    ModelView m_view;
    double m_by[3];
};

// 100 km, 80 km and 1 km in cells of a model whose unit is the metre.
inline void farCells(const ModelView& model, int32_t (&cells)[3])
{
    constexpr double kMetres[3] = {100e3, 80e3, 1e3};
    for (int a = 0; a < 3; ++a)
        cells[a] = int32_t(std::lround(kMetres[a] / double(model.params->voxel_size)));
}

// The camera moved with the model.
inline Camera movedCamera(Camera camera, const double (&by)[3])
{
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            camera.translation[r] -= camera.rotation[3 * c + r] * by[c];
    return camera;
}

// Camera of lookAt(), in double.
inline Camera cameraAt(float x, float z, uint32_t width, uint32_t height)
{
    const float position[3] = {x, 0.3f, z}, target[3] = {0.1f, -0.2f, 0.3f};
    const EyeParams eye = lookAt(position, target, 1.1f, width, height);
    Camera camera;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c)
            camera.rotation[3 * c + r] = double(eye.world_to_view[4 * r + c]);
        camera.translation[r] = double(eye.world_to_view[4 * r + 3]);
    }
    camera.fov_x = 2 * std::atan(double(eye.tan_fov_x));
    camera.fov_y = 2 * std::atan(double(eye.tan_fov_y));
    camera.width = width;
    camera.height = height;
    return camera;
}

} // namespace gsc::test
