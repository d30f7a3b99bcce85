// SPDX-License-Identifier: Apache-2.0
#include "convert/write/partition.h"

#include "format/numbers/count_text.h"
#include "convert/write/model_sections.h"
#include "convert/write/spatial_index.h"
#include <gsc/error.h>
#include "format/numbers/morton.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace gsc {

namespace {

constexpr int kFitRounds = 4;
constexpr size_t kMaxFailures = 4096; // most coordinates that are added to the sample after a failed fit
// binary logarithm of the quanta between 0 and the largest coordinate, if positions are floats
constexpr int kFloatQuantaLog2 = 17;

const char* const kStoredAsFloats = "positions are stored as floats, which takes 4 more bytes per anchor";

// note: keys of neighbours differ in the low bits only, and these vary enough; the product spreads them
struct KeyHash {
    size_t operator()(uint64_t key) const { return size_t(key * 0x9e3779b97f4a7c15ull >> 20); }
};

// Counts the anchors in each finest node (a cube of 128 quanta) of one level. Memory grows with the number of nodes.
class NodeCounter {
public:
    void add(uint64_t key)
    {
        if (!m_last || key != m_last_key) {
            m_last = &m_counts[key];
            m_last_key = key;
        }
        ++*m_last;
    }

    [[nodiscard]] std::vector<std::pair<uint64_t, uint64_t>> sorted() const
    {
        std::vector<std::pair<uint64_t, uint64_t>> result(m_counts.begin(), m_counts.end());
        std::sort(result.begin(), result.end());
        return result;
    }

private:
    // pointers to its values stay valid when it grows
    std::unordered_map<uint64_t, uint64_t, KeyHash> m_counts;
    uint64_t* m_last = nullptr;
    uint64_t m_last_key = 0;
};

uint64_t finestKey(const QuantaPosition& p)
{
    return mortonKey(p.quanta[0] >> kChunkLog2, p.quanta[1] >> kChunkLog2, p.quanta[2] >> kChunkLog2);
}

void setGrid(Partition& partition, const Grid& grid, uint32_t fork)
{
    partition.encoding = PositionEncoding::Grid;
    partition.grid = grid;
    for (LevelPlan& level : partition.levels) {
        level.quantum = levelQuantum(grid.voxel_size, fork, level.level);
        level.origin = grid.origin;
    }
}

// Sets quanta for float positions: a power of two, so that position / quantum is exact. With the largest cells there
// are still 4 nodes along each axis.
void setFloatGrid(Partition& partition)
{
    double largest = 0;
    for (const LevelRecord& level : partition.levels)
        for (int axis = 0; axis < 3; ++axis)
            largest = std::max(
                {largest, std::fabs(double(level.bounds_min[axis])), std::fabs(double(level.bounds_max[axis]))});
    const int exponent = largest > 0 ? std::max(std::ilogb(largest) + 1 - kFloatQuantaLog2, -120) : 0;
    partition.encoding = PositionEncoding::Float;
    partition.grid = {};
    for (LevelPlan& level : partition.levels) {
        level.quantum = float(std::ldexp(1.0, exponent));
        level.origin = 0;
    }
}

struct FitCheck {
    uint64_t failed = 0;               // number of anchors off the grid
    std::vector<GridSample> examples;  // some coordinates off the grid
    std::vector<NodeCounter> counters; // one per level; without the anchors off the grid
};

// Quanta of a position. Calls `fail` with each coordinate that is not on the grid.
template <typename Fail>
QuantaPosition placeOrFail(PositionEncoding encoding, const LevelRecord& level, const float position[3], Fail&& fail)
{
    QuantaPosition result{};
    for (int axis = 0; axis < 3; ++axis) {
        if (encoding == PositionEncoding::Float) {
            result.quanta[axis] = int32_t(std::floor(double(position[axis]) / double(level.quantum)));
        } else if (const auto point = locateOnGrid(position[axis], level.quantum, level.origin)) {
            result.quanta[axis] = point->quanta;
            result.flags = uint16_t(result.flags | (point->negative_zero ? kNegativeZeroX << axis : 0));
        } else {
            fail(position[axis]);
        }
    }
    return result;
}

FitCheck countNodes(AnchorSource& source, const ScanResult& scan, const Partition& partition,
                    const std::function<void(uint64_t)>& progress)
{
    FitCheck check;
    check.counters.resize(partition.levels.size());
    uint64_t done = 0;
    forEachPlacement(source, scan, [&](std::span<const ScannedPlace> placements) {
        for (const ScannedPlace& p : placements) {
            const uint32_t index = partition.levelIndex(p.level);
            const LevelPlan& level = partition.levels[index];
            bool exact = true;
            const QuantaPosition at = placeOrFail(partition.encoding, level, p.position, [&](float coordinate) {
                exact = false;
                if (check.examples.size() < kMaxFailures)
                    check.examples.push_back({coordinate, p.level});
            });
            if (exact)
                check.counters[index].add(finestKey(at));
            else
                ++check.failed;
        }
        done += placements.size();
        progress(done);
    });
    return check;
}

// Text of a warning that says how many anchors lie off the grid. The grid is that of the other anchors, found from a
// part of the sample that holds none of the outliers.
std::string describeMisfit(AnchorSource& source, const ScanResult& scan, Partition& partition, const GridHints& hints,
                           const std::function<void(uint64_t)>& progress)
{
    constexpr size_t kParts = 8;
    for (size_t part = 0; part < kParts; ++part) {
        std::vector<GridSample> samples;
        for (size_t i = part; i < scan.samples.size(); i += kParts)
            samples.push_back(scan.samples[i]);
        const std::optional<Grid> grid = fitGrid(samples, hints);
        if (!grid)
            continue;
        setGrid(partition, *grid, hints.fork);
        const uint64_t failed = countNodes(source, scan, partition, progress).failed;
        if (failed < scan.kept)
            return formatString("%llu of %llu anchors do not lie on the grid of the others (voxel size %.9g, origin "
                                "%.9g); %s",
                                (unsigned long long)failed, (unsigned long long)scan.kept, double(grid->voxel_size),
                                double(grid->origin), kStoredAsFloats);
    }
    const std::string size =
        hints.fixed ? formatString(" of the model's voxel size %.9g", double(hints.voxel_size)) : std::string();
    return formatString("the %llu anchors do not lie on one voxel grid%s; %s", (unsigned long long)scan.kept,
                        size.c_str(), kStoredAsFloats);
}

// Smallest cell_log2 that OpenVDB accepts for a level: it takes no smaller voxels than kLeastCell.
uint32_t leastCellLog2(double quantum)
{
    uint32_t log2 = 0;
    while (log2 < kMaxCellLog2 && std::ldexp(quantum, int(log2)) < kLeastCell)
        ++log2;
    return log2;
}

// Chooses the smallest cell with which a node holds `wanted` anchors on average; if none is large enough, the smallest
// of those with the fewest nodes. Each node becomes a chunk.
void chooseCells(LevelPlan& level, const NodeCounter& counter, uint64_t wanted, std::vector<ChunkRecord>& chunks,
                 uint32_t level_index)
{
    const std::vector<std::pair<uint64_t, uint64_t>> nodes = counter.sorted();
    const auto countAt = [&](uint32_t log2) {
        uint64_t count = 0;
        for (size_t i = 0; i < nodes.size(); ++i)
            count += i == 0 || nodes[i].first >> 3 * log2 != nodes[i - 1].first >> 3 * log2 ? 1 : 0;
        return count;
    };
    const uint64_t fewest = countAt(kMaxCellLog2);
    level.cell_log2 = leastCellLog2(double(level.quantum));
    for (; level.cell_log2 < kMaxCellLog2; ++level.cell_log2) {
        const uint64_t count = countAt(level.cell_log2);
        if (count == fewest || level.anchor_count / count >= wanted)
            break;
    }
    level.chunk_first = chunks.size();
    for (const auto& [finest, count] : nodes) {
        const uint64_t key = finest >> 3 * level.cell_log2;
        if (level.keys.empty() || level.keys.back() != key) {
            level.keys.push_back(key);
            ChunkRecord chunk{};
            chunk.level_index = level_index;
            mortonCorner(key, level.cell_log2, chunk.origin);
            for (int32_t& c : chunk.origin)
                c *= 1 << kChunkLog2;
            chunks.push_back(chunk);
        }
        chunks.back().anchor_count += uint32_t(count);
    }
    level.chunk_count = level.keys.size();
}

void choose(Partition& partition, const FitCheck& check, uint64_t wanted)
{
    partition.chunks.clear();
    for (uint32_t i = 0; i < partition.levels.size(); ++i) {
        partition.levels[i].keys.clear();
        chooseCells(partition.levels[i], check.counters[i], wanted, partition.chunks, i);
    }
}

// Returns true if the grid makes very many chunks of very few anchors: a chunk can be at most 2^16 quanta wide, so a
// fine grid scatters distant anchors over chunks.
bool isTooFine(const Partition& partition, uint64_t anchors, uint64_t wanted)
{
    constexpr uint64_t kManyChunks = 64, kFewAnchors = 2 * kGroupSize;
    const uint64_t chunks = partition.chunks.size();
    return chunks > kManyChunks && anchors / chunks < std::min(wanted, kFewAnchors);
}

} // namespace

uint32_t Partition::levelIndex(int32_t level) const
{
    uint32_t index = 0;
    while (levels[index].level != level)
        ++index;
    return index;
}

Partition planPartition(AnchorSource& source, ScanResult& scan, const Checkpoint& checkpoint, uint64_t chunk_anchors,
                        const std::function<void(uint64_t)>& progress)
{
    if (scan.levels.size() > kMaxLevels)
        throw Error(ErrorCode::InvalidFile, checkpoint.ply_path,
                    formatString("has anchors on %zu levels", scan.levels.size()),
                    formatString("at most %u", kMaxLevels), "train with fewer");
    GridHints hints;
    hints.voxel_size = checkpoint.voxel_size;
    hints.fork = checkpoint.fork;
    hints.may_have_origin = checkpoint.flags & kModelHasLevels;
    // the file stores one voxel size for positions and level rule, so the level rule's cannot be changed
    hints.fixed = modelParams(checkpoint).voxel_size > 0;
    Partition partition;
    for (const auto& [value, level] : scan.levels)
        partition.levels.push_back({level, {}});

    FitCheck check;
    bool exact = false;
    for (int round = 0; round < kFitRounds && !exact; ++round) {
        const std::optional<Grid> grid = fitGrid(scan.samples, hints);
        if (!grid)
            break;
        setGrid(partition, *grid, hints.fork);
        check = countNodes(source, scan, partition, progress);
        exact = check.failed == 0;
        // the grid found from the sample does not fit all: the coordinates off it join the sample
        scan.samples.insert(scan.samples.end(), check.examples.begin(), check.examples.end());
    }
    if (!exact)
        partition.warnings.push_back(describeMisfit(source, scan, partition, hints, progress));
    if (exact) {
        choose(partition, check, chunk_anchors);
        exact = !isTooFine(partition, scan.kept, chunk_anchors);
        if (!exact)
            partition.warnings.push_back(
                formatString("the voxel grid (voxel size %.9g) is too fine for the extent of the model: %s of %s on "
                             "average; %s",
                             double(partition.grid.voxel_size), formatCount(partition.chunks.size(), "chunk").c_str(),
                             formatCount(scan.kept / partition.chunks.size(), "anchor").c_str(), kStoredAsFloats));
    }
    if (!exact) {
        setFloatGrid(partition);
        check = countNodes(source, scan, partition, progress);
        choose(partition, check, chunk_anchors);
    }
    return partition;
}

QuantaPosition placeAnchor(PositionEncoding encoding, const LevelRecord& level, const float position[3])
{
    return placeOrFail(encoding, level, position, [](float coordinate) {
        throw Error(ErrorCode::InvalidFile, formatString("coordinate %.9g", double(coordinate)),
                    "not on the voxel grid", "the grid the scan found",
                    "convert again while nobody changes the checkpoint");
    });
}

uint32_t ChunkFinder::find(uint32_t level_index, const QuantaPosition& position)
{
    const LevelPlan& level = m_partition.levels[level_index];
    const uint64_t key = finestKey(position) >> 3 * level.cell_log2;
    if (level_index == m_last_level && key == m_last_key)
        return m_last_chunk;
    const auto found = std::lower_bound(level.keys.begin(), level.keys.end(), key);
    if (found == level.keys.end() || *found != key)
        throw Error(ErrorCode::InvalidFile, "chunk", "an anchor lies where the scan met none", "the same anchors",
                    "convert again while nobody changes the checkpoint");
    m_last_level = level_index;
    m_last_key = key;
    m_last_chunk = uint32_t(level.chunk_first) + uint32_t(found - level.keys.begin());
    return m_last_chunk;
}

} // namespace gsc
