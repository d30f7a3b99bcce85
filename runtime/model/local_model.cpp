// SPDX-License-Identifier: Apache-2.0
#include "runtime/model/local_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gsc {

namespace {

// number of groups that are looked at: enough to find a model's place, and fast even for a city
constexpr uint64_t kMostSampled = 4096;

// A value, and the number of anchors that it stands for.
struct Sample {
    double value;
    uint64_t weight;
};

// Returns the value below which half of the anchors lie. Precondition: `samples` is not empty.
double median(std::vector<Sample> samples)
{
    std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.value < b.value; });
    uint64_t all = 0, below = 0;
    for (const Sample& sample : samples)
        all += sample.weight;
    size_t i = 0;
    while (2 * (below += samples[i].weight) < all)
        ++i;
    return samples[i].value;
}

// Median of value(group) over all groups, or every n-th of many; each weighs as much as it has anchors.
template <typename Value>
double medianOfGroups(const ModelView& model, Value value)
{
    const uint64_t count = model.params->group_count, step = (count + kMostSampled - 1) / kMostSampled;
    std::vector<Sample> samples;
    for (uint64_t g = 0; g < count; g += step)
        samples.push_back({double(value(model.groups[g])), model.groups[g].anchor_count});
    return median(std::move(samples));
}

// Returns one coordinate of a grid position as it was before the trainer rounded it to fp32, with a relative error of
// 1e-16.
double unroundedCoordinate(int32_t quanta, const LevelRecord& level, bool negative_zero)
{
    return negative_zero ? 0.0 : double(quanta) * double(level.quantum) + double(level.origin);
}

// Makes bounds relative to `origin`, rounded outwards. The stored coordinates were rounded twice, first as multiples
// of the quantum before `grid_origin` was added; those of Gaussians once more.
void moveBounds(float* low, float* high, const double* origin, float grid_origin)
{
    constexpr double kRounding = 0x1p-22;
    const auto slack = [&](float v) { return kRounding * (std::fabs(double(v)) + std::fabs(double(grid_origin))); };
    for (int i = 0; i < 3; ++i) {
        low[i] = std::nextafter(float(double(low[i]) - origin[i] - slack(low[i])), -INFINITY);
        high[i] = std::nextafter(float(double(high[i]) - origin[i] + slack(high[i])), INFINITY);
    }
}

template <typename Record>
void moveRecord(Record& record, const double* origin, float grid_origin)
{
    moveBounds(record.anchor_min, record.anchor_max, origin, grid_origin);
    moveBounds(record.gaussian_min, record.gaussian_max, origin, grid_origin);
}

} // namespace

std::optional<std::array<double, 3>> localOrigin(const ModelView& model)
{
    if (model.params->group_count == 0)
        return std::nullopt;
    std::array<double, 3> origin{};
    double distance = 0;
    for (size_t i = 0; i < 3; ++i) {
        origin[i] = medianOfGroups(
            model, [i](const GroupRecord& group) { return 0.5f * group.anchor_min[i] + 0.5f * group.anchor_max[i]; });
        distance = std::max(distance, std::fabs(origin[i]));
    }
    const double reach = medianOfGroups(model, [&origin](const GroupRecord& group) {
        double farthest = 0;
        for (size_t i = 0; i < 3; ++i)
            farthest =
                std::max({farthest, origin[i] - double(group.anchor_min[i]), double(group.anchor_max[i]) - origin[i]});
        return farthest;
    });
    if (!(distance > kFarReaches * reach))
        return std::nullopt;
    return origin;
}

LocalModel::LocalModel(const ModelView& model, const std::array<double, 3>& origin)
    : m_params(*model.params), m_levels(model.levels, model.levels + m_params.level_count),
      m_chunks(model.chunks, model.chunks + m_params.chunk_count),
      m_groups(model.groups, model.groups + m_params.group_count),
      m_arrays(model.arrays, model.arrays + m_params.chunk_count), m_view(model)
{
    std::copy(origin.begin(), origin.end(), m_view.origin);
    movePositions(model);
    const float grid_origin = m_params.grid_origin;
    moveBounds(m_params.bounds_min, m_params.bounds_max, m_view.origin, grid_origin);
    for (LevelRecord& level : m_levels)
        moveBounds(level.bounds_min, level.bounds_max, m_view.origin, grid_origin);
    for (ChunkRecord& chunk : m_chunks)
        moveRecord(chunk, m_view.origin, grid_origin);
    for (GroupRecord& group : m_groups)
        moveRecord(group, m_view.origin, grid_origin);
    m_view.params = &m_params;
    m_view.levels = m_levels.data();
    m_view.chunks = m_chunks.data();
    m_view.groups = m_groups.data();
    m_view.arrays = m_arrays.data();
}

// Converts positions to floats: a level's grid has the same origin on all axes, and does not fit a new origin in
// general.
void LocalModel::movePositions(const ModelView& model)
{
    uint64_t anchors = 0;
    for (const ChunkRecord& chunk : m_chunks)
        anchors += chunk.anchor_count;
    m_positions = std::make_unique_for_overwrite<float[]>(3 * anchors);
    m_params.position_encoding = uint32_t(PositionEncoding::Float);
    float* to = m_positions.get();
    for (size_t c = 0; c < m_chunks.size(); ++c) {
        ChunkRecord& chunk = m_chunks[c];
        const ChunkArrays& from = model.arrays[c];
        const LevelRecord& level = model.levels[chunk.level_index];
        m_arrays[c].grid_position = nullptr;
        m_arrays[c].float_position = to;
        chunk.payload_bytes = chunkArrayLayout(m_params, chunk.anchor_count).bytes;
        for (uint32_t i = 0; i < chunk.anchor_count; ++i)
            for (uint32_t a = 0; a < 3; ++a) {
                double coordinate = 0;
                if (from.grid_position != nullptr) {
                    const GridPosition& at = from.grid_position[i];
                    coordinate =
                        unroundedCoordinate(chunk.origin[a] + int32_t(at.local[a]), level, (at.flags >> a & 1) != 0);
                } else
                    coordinate = double(from.float_position[size_t(3) * i + a]);
                *to++ = float(coordinate - m_view.origin[a]);
            }
    }
}

} // namespace gsc
