// SPDX-License-Identifier: Apache-2.0
// Repeats a real aerial model into a city. Copies are shifted, not turned, so that the view-dependent MLPs stay valid.
// Each anchor is also jittered a little, so that no two copies have equal depths. Both shifts are whole cells of the
// anchor's grid.
#include "convert/sample/sample.h"

#include "convert/input/input_file.h"
#include "convert/sample/model/hash_random.h"
#include "convert/sample/model/model_folder.h"
#include "convert/sample/model/model_text.h"
#include "convert/sample/paths/site_paths.h"
#include "convert/sample/replicate_source.h"
#include "convert/write/write_gsc.h"
#include <gsc/error.h>
#include <gsc/gsc_layout.h>
#include <gsc/interrupt.h>

#include <glm/gtc/type_precision.hpp>

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace gsc {

namespace {

// standard deviation of an anchor's random shift, as a multiple of its scales
constexpr double kJitter = 0.1;
constexpr size_t kFlushRows = 16'384;

// The city as a grid of equal tiles; the last ones may be missing.
struct CityGrid {
    uint64_t tiles = 0, columns = 0, rows = 0;
    double size[2] = {}; // width and depth of a tile in world units
};

CityGrid cityGrid(const ReplicateSource& source, uint64_t anchors)
{
    CityGrid grid;
    grid.tiles = (anchors + source.anchors.size() - 1) / source.anchors.size();
    grid.columns = uint64_t(std::ceil(std::sqrt(double(grid.tiles))));
    grid.rows = (grid.tiles + grid.columns - 1) / grid.columns;
    for (int i = 0; i < 2; ++i)
        grid.size[i] = source.frame.high[i] - source.frame.low[i];
    return grid;
}

// Random number with the standard normal distribution, by Marsaglia's polar method.
double normalVariate(HashRandom& random)
{
    for (;;) {
        const double u = random.between(-1, 1), v = random.between(-1, 1), s = u * u + v * v;
        if (s > 0 && s < 1)
            return u * std::sqrt(-2 * std::log(s) / s);
    }
}

// Moves an anchor's row by whole cells of its grid: by `cells` of the coarsest level, and by a random shift of its own.
void placeRow(const ReplicateSource& source, const TileAnchor& anchor, const glm::i64vec3& cells, HashRandom random,
              float* row)
{
    const float quantum = source.quantum[size_t(anchor.level)];
    const int64_t per_step = std::llround(double(source.quantum[0]) / double(quantum));
    const float* scale = row + source.row_floats - 10;
    for (int axis = 0; axis < 3; ++axis) {
        const double sigma = kJitter * std::exp(double(scale[axis]));
        const double jitter = std::isfinite(sigma) ? sigma * normalVariate(random) / double(quantum) : 0;
        const int64_t k = anchor.quanta[axis] + cells[axis] * per_step + std::llround(jitter);
        if (std::abs(k) >= int64_t(1) << 24)
            throw Error(ErrorCode::Usage, "--anchors",
                        "the city would leave the range in which the voxel grid is exact in single precision",
                        "a city within it", "ask for fewer");
        row[axis] = gridCoordinate(int32_t(k), quantum, source.origin, false);
    }
}

// Writes the rows of all tiles, tile by tile.
void writeTiles(const ReplicateSource& source, const CityGrid& grid, const ReplicateOptions& options,
                float standard_dist, const NewFolder& folder, const std::string& ply, const SampleProgress& progress)
{
    std::vector<float> rows;
    uint64_t written = 0;
    const auto flush = [&] {
        throwIfInterrupted();
        folder.append(ply, std::as_bytes(std::span(rows)));
        rows.clear();
    };
    for (uint64_t tile = 0; tile < grid.tiles; ++tile) {
        const uint64_t column = tile % grid.columns, line = tile / grid.columns;
        const dvec3 move = source.frame.axis[0] * (grid.size[0] * double(column)) +
                           source.frame.axis[1] * (grid.size[1] * double(line));
        // the shift is a whole number of cells of the coarsest level, so that it is one on every level
        const dvec3 moved = move / double(source.quantum[0]);
        const glm::i64vec3 cells(std::llround(moved.x), std::llround(moved.y), std::llround(moved.z));
        const uint64_t count = std::min<uint64_t>(options.anchors - written, source.anchors.size());
        for (uint64_t i = 0; i < count; ++i, ++written) {
            const float* from = &source.rows[i * source.row_floats];
            rows.insert(rows.end(), from, from + source.row_floats);
            float* row = &rows[rows.size() - source.row_floats];
            placeRow(source, source.anchors[i], cells, HashRandom(hashKey(options.seed, tile, i)), row);
            if (source.octree)
                row[5] = written == 0 ? source.quantum[0] : written == 1 ? standard_dist : 0.0f;
            if (rows.size() >= kFlushRows * source.row_floats)
                flush();
        }
        if (progress)
            progress("anchors", written, options.anchors);
    }
    flush();
}

// The metre of the source model, as `gsc convert` would find it: the city has trees and houses of the same size.
Metre metreOf(const Checkpoint& checkpoint, const CityGrid& grid, const NewFolder& folder,
              const SampleProgress& progress)
{
    Metre metre = checkpoint.metre;
    if (!(metre.units > 0)) {
        WriteOptions options;
        options.output = folder.file("source.gsc");
        options.drop_invalid = true;
        options.sensitivity = SensitivityMode::None;
        metre = writeGsc(checkpoint, options, progress).metre;
        std::filesystem::remove(options.output);
    }
    if (!(metre.units > 0))
        return {metreOfGround(grid.size[0], grid.size[1]), "0.0625 of the square root of a tile's area"};
    constexpr std::string_view kOf = "of the model that is repeated: ";
    if (!metre.rule.starts_with(kOf))
        metre.rule = kOf.data() + metre.rule;
    return metre;
}

PathSite pathSite(const ReplicateSource& source, const CityGrid& grid, const Checkpoint& checkpoint, double metre)
{
    PathSite site{source.frame};
    site.high[0] = site.low[0] + grid.size[0] * double(grid.columns);
    site.high[1] = site.low[1] + grid.size[1] * double(grid.rows);
    site.metre = metre;
    if (source.octree) {
        site.level_rule = checkpoint.level_rule;
        site.standard_dist = double(checkpoint.standard_dist);
        site.fork = checkpoint.fork;
        site.finest_level = checkpoint.level_clamp;
    }
    return site;
}

// Throws if `path`, which is read, lies in the folder that the city replaces.
void refuseSource(const std::string& output, const std::string& path)
{
    std::error_code error;
    for (std::filesystem::path at = std::filesystem::weakly_canonical(path, error); !error; at = at.parent_path()) {
        if (std::filesystem::equivalent(at, output, error))
            throw Error(ErrorCode::Usage, output, "holds the source " + path + ", which the city would replace",
                        "a folder without it", "choose another folder");
        error.clear(); // an output that does not exist cannot hold the source
        if (at == at.parent_path())
            return;
    }
}

} // namespace

SampleReport replicateCheckpoint(const ReplicateOptions& options, const SampleProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    if (options.anchors < 2 || options.anchors > kMaxAnchors)
        throw Error(ErrorCode::Usage, formatString("--anchors %llu", static_cast<unsigned long long>(options.anchors)),
                    "out of range", formatString("2 to %llu", static_cast<unsigned long long>(kMaxAnchors)),
                    "pass another number");
    refuseSource(options.output, options.input);
    NewFolder folder(options.output, options.overwrite, kModelFolder);
    const Checkpoint checkpoint = readCheckpoint(options.input, {});
    refuseSource(options.output, checkpoint.ply_path); // the PLY may lie in the output behind a link
    for (const std::string& path : checkpoint.weight_paths)
        refuseSource(options.output, path);
    const ReplicateSource source = readReplicateSource(checkpoint);
    const CityGrid grid = cityGrid(source, options.anchors);

    const std::string iteration = formatString("point_cloud/iteration_%d/", std::max(checkpoint.iteration, 0));
    for (const std::string& path : checkpoint.weight_paths)
        folder.append(iteration + std::filesystem::path(path).filename().string(),
                      readWholeFile(path, UINT64_MAX, "weights"));
    if (!checkpoint.cfg_args.empty())
        folder.append("cfg_args", checkpoint.cfg_args);
    const Metre metre = metreOf(checkpoint, grid, folder, progress);
    folder.append(kMetreFile, metreFileText(metre));
    const std::vector<CameraPath> paths = sitePaths(pathSite(source, grid, checkpoint, metre.units));
    folder.append("cameras.json", camerasJson(paths.front().frames));
    writeSitePaths(folder, paths);

    const std::string ply = iteration + "point_cloud.ply";
    folder.append(ply, plyHeader(options.anchors, source.octree, checkpoint.feat_dim, checkpoint.n_offsets));
    writeTiles(source, grid, options, checkpoint.standard_dist, folder, ply, progress);
    throwIfInterrupted();

    SampleReport report;
    report.anchors = options.anchors;
    report.tiles = grid.tiles;
    report.ply_bytes = std::filesystem::file_size(folder.file(ply));
    folder.commit();
    report.path_file = (std::filesystem::path(options.output) / kFirstPath).string();
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

} // namespace gsc
