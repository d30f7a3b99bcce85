// SPDX-License-Identifier: Apache-2.0
// A real aerial model repeated into a city. Copies differ by a translation, so that the view-dependent MLPs hold, and
// by a small jitter per anchor, so that no two copies tie in depth; both are whole cells of the anchor's own grid.
#include "convert/sample/sample.h"

#include "convert/sample/paths/camera_paths.h"
#include "convert/sample/hash_random.h"
#include "convert/sample/model_folder.h"
#include "convert/sample/model_text.h"
#include "convert/sample/replicate/replicate_source.h"
#include "format/error.h"
#include "format/gsc_layout.h"
#include "format/interrupt.h"

#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace gsc {

namespace {

constexpr double kJitter = 0.1; // of the anchor's scale
constexpr size_t kFlushRows = 16'384;

// The city as a grid of equal tiles; the last ones are left out where fewer are needed.
struct CityGrid {
    uint64_t tiles = 0, columns = 0, rows = 0;
    double size[2] = {}; // of a tile
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

// Normal variate by the polar method.
double normalVariate(HashRandom& random)
{
    for (;;) {
        const double u = random.between(-1, 1), v = random.between(-1, 1), s = u * u + v * v;
        if (s > 0 && s < 1)
            return u * std::sqrt(-2 * std::log(s) / s);
    }
}

class TileWriter {
public:
    TileWriter(const ReplicateSource& source, uint64_t seed, float standard_dist, FileStream& ply)
        : m_source(source), m_seed(seed), m_standard_dist(standard_dist), m_ply(ply)
    {
        // the finest quantum divides every coarser one, but a tile moves as a whole: in cells of the coarsest level
        m_step = double(source.quantum[0]);
    }

    void write(uint64_t tile, Vec3 move, uint64_t count)
    {
        const double moved[3] = {move.x, move.y, move.z};
        int64_t cells[3];
        for (int axis = 0; axis < 3; ++axis)
            cells[axis] = std::llround(moved[axis] / m_step);
        for (uint64_t i = 0; i < count; ++i, ++m_row) {
            const float* from = &m_source.rows[i * m_source.row_floats];
            m_rows.insert(m_rows.end(), from, from + m_source.row_floats);
            float* row = &m_rows[m_rows.size() - m_source.row_floats];
            place(tile, i, cells, row);
            if (m_source.octree)
                row[5] = m_row == 0 ? m_source.quantum[0] : m_row == 1 ? m_standard_dist : 0.0f;
            if (m_rows.size() >= kFlushRows * m_source.row_floats)
                flush();
        }
    }

    void flush()
    {
        throwIfInterrupted();
        m_ply.write(m_rows.data(), m_rows.size() * sizeof(float));
        m_rows.clear();
    }

private:
    void place(uint64_t tile, uint64_t i, const int64_t cells[3], float* row)
    {
        const TileAnchor& anchor = m_source.anchors[i];
        const float quantum = m_source.quantum[size_t(anchor.level)];
        const int64_t per_step = std::llround(m_step / double(quantum));
        const float* scale = row + m_source.row_floats - 10;
        HashRandom random(hashKey(m_seed, tile, i));
        for (int axis = 0; axis < 3; ++axis) {
            const double sigma = kJitter * std::exp(double(scale[axis]));
            const double jitter = std::isfinite(sigma) ? sigma * normalVariate(random) / double(quantum) : 0;
            const int64_t k = anchor.quanta[axis] + cells[axis] * per_step + std::llround(jitter);
            if (std::abs(k) >= int64_t(1) << 24)
                throw Error(ErrorCode::Usage, "--anchors: the city would leave the range in which the voxel grid is "
                                              "exact in single precision, expected a city within it; ask for fewer");
            row[axis] = gridCoordinate(int32_t(k), quantum, m_source.origin, false);
        }
    }

    const ReplicateSource& m_source;
    uint64_t m_seed;
    float m_standard_dist;
    FileStream& m_ply;
    double m_step;
    uint64_t m_row = 0;
    std::vector<float> m_rows;
};

PathSite pathSite(const ReplicateSource& source, const CityGrid& grid, const Checkpoint& checkpoint)
{
    const GroundFrame& frame = source.frame;
    const uint64_t tiles[2] = {grid.columns, grid.rows};
    PathSite site;
    site.up = frame.up;
    for (int i = 0; i < 2; ++i) {
        site.axis[i] = frame.axis[i];
        site.low[i] = frame.low[i];
        site.high[i] = frame.low[i] + grid.size[i] * double(tiles[i]);
    }
    site.ground = frame.ground;
    site.view_height = frame.capture_height;
    // no model states its scale: the viewer is as large as puts his eyes 0.004 of a tile's side apart
    site.metre = metreOfGround(grid.size[0], grid.size[1]);
    if (source.octree) {
        site.level_rule = checkpoint.level_rule;
        site.standard_dist = double(checkpoint.standard_dist);
        site.fork = checkpoint.fork;
        site.finest_level = checkpoint.level_clamp;
    }
    return site;
}

// `path` is read: it must not lie in the folder that the city replaces.
void refuseSource(const std::string& output, const std::string& path)
{
    std::error_code error;
    for (std::filesystem::path at = std::filesystem::weakly_canonical(path, error); !error; at = at.parent_path()) {
        if (std::filesystem::equivalent(at, output, error))
            throw Error(ErrorCode::Usage,
                        output + ": holds the source " + path +
                            ", which the city would replace, expected a folder without it; choose another folder");
        error.clear(); // an output that does not exist is nobody's source
        if (at == at.parent_path())
            return;
    }
}

void copyFile(const std::string& from, const std::string& to)
{
    std::ifstream in(from, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    if (!in)
        throw Error(ErrorCode::Io, from + ": cannot be read, expected a readable file; check its rights and the disk");
    writeFile(to, bytes);
}

} // namespace

SampleReport replicateCheckpoint(const ReplicateOptions& options, const SampleProgress& progress)
{
    const auto start = std::chrono::steady_clock::now();
    if (options.anchors < 2 || options.anchors > kMaxAnchors)
        throw Error(ErrorCode::Usage,
                    formatString("--anchors %llu: out of range, expected 2 to %llu; pass another number",
                                 static_cast<unsigned long long>(options.anchors),
                                 static_cast<unsigned long long>(kMaxAnchors)));
    refuseSource(options.output, options.input);
    ModelFolder folder(options.output, options.overwrite);
    const Checkpoint checkpoint = readCheckpoint(options.input, {});
    refuseSource(options.output, checkpoint.ply_path); // the input may reach it through a link
    for (const std::string& path : checkpoint.weight_paths)
        refuseSource(options.output, path);
    const ReplicateSource source = readReplicateSource(checkpoint);
    const CityGrid grid = cityGrid(source, options.anchors);

    const std::string iteration = formatString("point_cloud/iteration_%d/", std::max(checkpoint.iteration, 0));
    for (const std::string& path : checkpoint.weight_paths)
        copyFile(path, folder.file(iteration + std::filesystem::path(path).filename().string()));
    if (!checkpoint.cfg_args.empty())
        writeFile(folder.file("cfg_args"), checkpoint.cfg_args);
    const std::vector<CameraPath> paths = cameraPaths(pathSite(source, grid, checkpoint));
    writeFile(folder.file("cameras.json"), camerasJson(paths.front().frames));
    const std::string path_file = writeCameraPaths(folder, paths);

    FileStream ply(folder.file(iteration + "point_cloud.ply"));
    const std::string header = plyHeader(options.anchors, source.octree, checkpoint.feat_dim, checkpoint.n_offsets);
    ply.write(header.data(), header.size());
    TileWriter writer(source, options.seed, checkpoint.standard_dist, ply);
    uint64_t left = options.anchors;
    for (uint64_t tile = 0; tile < grid.tiles; ++tile) {
        const uint64_t column = tile % grid.columns, row = tile / grid.columns;
        const Vec3 move = source.frame.axis[0] * (grid.size[0] * double(column)) +
                          source.frame.axis[1] * (grid.size[1] * double(row));
        const uint64_t count = std::min<uint64_t>(left, source.anchors.size());
        writer.write(tile, move, count);
        left -= count;
        if (progress)
            progress("anchors", options.anchors - left, options.anchors);
    }
    writer.flush();
    ply.close();
    throwIfInterrupted();
    folder.commit();

    SampleReport report;
    report.anchors = options.anchors;
    report.tiles = grid.tiles;
    report.ply_bytes = ply.bytes();
    report.path_file = (std::filesystem::path(options.output) / path_file).string();
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return report;
}

} // namespace gsc
