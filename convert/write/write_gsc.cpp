// SPDX-License-Identifier: Apache-2.0
#include "convert/write/write_gsc.h"

#include "convert/write/anchor_record.h"
#include "convert/write/chunk_build.h"
#include "convert/write/distribute.h"
#include "convert/write/metre_finder.h"
#include "convert/write/mlp_pack.h"
#include "convert/write/model_sections.h"
#include "convert/write/partition.h"
#include "convert/write/sensitivity_sampler.h"
#include "convert/write/source_hash.h"
#include "convert/write/spatial_index.h"
#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/gsc_writer.h>
#include <gsc/interrupt.h>
#include "format/machine/machine.h"
#include "kernels/threads/parallel.h"
#include "kernels/threads/tbb_bound.h"
#include "runtime/module/load_module.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <new>
#include <optional>
#include <stop_token>
#include <system_error>
#include <thread>

namespace gsc {

namespace {

struct StopOnExit {
    std::stop_source& stop;
    ~StopOnExit() { stop.request_stop(); }
};

uint64_t defaultBudget()
{
    constexpr uint64_t kMost = uint64_t(1) << 30;
    const uint64_t memory = usableMemory();
    return memory > 0 ? std::min(kMost, memory / 4) : kMost;
}

// One call of writeGscFrom(). The members are its state, in the order in which the stages set them.
class Writer {
public:
    Writer(const Checkpoint& checkpoint, AnchorSource& source, const WriteOptions& options, int threads,
           const WriteProgress& progress)
        : m_checkpoint(checkpoint), m_source(source), m_options(options), m_progress(progress),
          m_budget(options.memory_budget ? options.memory_budget : defaultBudget()), m_workers(threads)
    {
    }

    WriteReport run()
    {
        const char* name = m_checkpoint.model_path.c_str();
        checkMlps(m_checkpoint.mlps, name);
        m_rows = keptEmbeddingRows(m_checkpoint, m_options.appearance);
        if (m_checkpoint.anchor_count == 0 || m_checkpoint.anchor_count >= UINT32_MAX)
            throw Error(ErrorCode::InvalidFile, name,
                        formatString("has %llu anchors", (unsigned long long)m_checkpoint.anchor_count),
                        formatString("1 to %u", UINT32_MAX - 1), "pass a trained model of such a size");
        // created before any work, because it throws if the output cannot be written
        GscWriter writer(m_options.output, m_options.overwrite);

        // the thread that hashes the file reads shortly behind the scan, so its pages are still in memory
        std::stop_source stop;
        std::future<SourceHash> hash = startHash(stop.get_token());
        // stops the hashing if an exception leaves this function, because the future waits for its thread
        const StopOnExit guard{stop};
        stage("scan", [&] { scan(); });
        stage("hash", [&] { m_hash = hash.get(); });
        stage("grid", [&] { partition(); });
        planChunks();
        stage("distribute", [&] { distribute(writer); });
        stage("chunks", [&] { buildChunks(writer); });
        stage("metre",
              [&] { m_report.metre = m_metre_finder ? m_metre_finder->derive(m_checkpoint) : m_checkpoint.metre; });
        stage("index", [&] { buildIndex(); });
        stage("write", [&] { writeSections(writer); });
        m_index = decltype(m_index)(); // note: assigning = {} would keep the memory
        m_sensitivity.reset();
        m_nanovdb = decltype(m_nanovdb)();
        if (m_options.verify)
            stage("verify", [&] { m_options.verify(writer.temporaryPath()); });
        throwIfInterrupted(); // the last chance to stop before the output is replaced
        writer.commit();
        m_report.input_bytes = m_hash.bytes;
        return std::move(m_report);
    }

private:
    std::future<SourceHash> startHash(std::stop_token token)
    {
        const auto hash = [this, token] {
            return m_options.source ? SourceHash{m_options.source->hash, 0} : hashSources(m_checkpoint, token);
        };
        const ThreadAttempt attempt;
        try {
            return std::async(m_workers.count() == 1 ? std::launch::deferred : std::launch::async, hash);
            // no thread can be started: hash in this one, later
        } catch (const std::system_error&) {
            return std::async(std::launch::deferred, hash);
        }
    }

    template <typename Work>
    void stage(const char* name, Work&& work)
    {
        throwIfInterrupted();
        m_stage = name;
        const auto start = std::chrono::steady_clock::now();
        work();
        m_report.stages.push_back(
            {name, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()});
    }

    // note: stages run on several threads, but callers of writeGsc() are promised calls from one thread
    void tell(uint64_t done, uint64_t total) const
    {
        if (m_progress && std::this_thread::get_id() == m_thread)
            m_progress(m_stage, done, total);
    }

    void scan()
    {
        m_scan = scanAnchors(m_source, m_checkpoint, m_options.drop_invalid, m_budget / 2,
                             [&](uint64_t done) { tell(done, m_checkpoint.anchor_count); });
        m_report.warnings = m_scan.warnings;
    }

    void partition()
    {
        m_partition = planPartition(m_source, m_scan, m_checkpoint, m_options.chunk_anchors,
                                    [&](uint64_t done) { tell(done, m_scan.kept); });
        m_scan.placements = decltype(m_scan.placements)();
        m_report.warnings.insert(m_report.warnings.end(), m_partition.warnings.begin(), m_partition.warnings.end());
        m_report.exact_grid = m_partition.encoding == PositionEncoding::Grid;
    }

    void planChunks()
    {
        m_params = modelParams(m_checkpoint);
        m_params.flags |= m_scan.varying;
        const float identity[4] = {1, 0, 0, 0};
        std::copy_n(m_scan.varying & kModelHasRotation ? identity : m_scan.rotation, 4, m_params.constant_rotation);
        m_params.constant_opacity = m_scan.varying & kModelHasOpacity ? 0 : m_scan.opacity;
        m_params.position_encoding = uint32_t(m_partition.encoding);
        if (!(m_params.voxel_size > 0))
            m_params.voxel_size = m_partition.grid.voxel_size;
        m_params.grid_origin = m_partition.grid.origin;
        m_params.level_count = uint32_t(m_partition.levels.size());
        m_params.level_min = m_partition.levels.front().level;
        m_params.appearance_rows = uint32_t(m_rows.size());
        std::copy_n(m_partition.levels.front().bounds_min, 3, m_params.bounds_min);
        std::copy_n(m_partition.levels.front().bounds_max, 3, m_params.bounds_max);
        for (const LevelRecord& level : m_partition.levels)
            for (int axis = 0; axis < 3; ++axis) {
                m_params.bounds_min[axis] = std::min(m_params.bounds_min[axis], level.bounds_min[axis]);
                m_params.bounds_max[axis] = std::max(m_params.bounds_max[axis], level.bounds_max[axis]);
            }

        m_chunks = m_partition.chunks;
        uint64_t offset = 0, anchors = 0, groups = 0;
        for (ChunkRecord& chunk : m_chunks) {
            chunk.payload_offset = offset;
            chunk.payload_bytes = chunkArrayLayout(m_params, chunk.anchor_count).bytes;
            chunk.anchor_first = uint32_t(anchors);
            chunk.group_first = uint32_t(groups);
            chunk.group_count = (chunk.anchor_count + kGroupSize - 1) / kGroupSize;
            offset = alignUp(offset + chunk.payload_bytes, kPayloadAlign);
            anchors += chunk.anchor_count;
            groups += chunk.group_count;
            m_params.max_chunk_anchors = std::max(m_params.max_chunk_anchors, chunk.anchor_count);
            m_params.max_chunk_bytes = std::max(m_params.max_chunk_bytes, chunk.payload_bytes);
        }
        m_anchors_bytes = m_chunks.back().payload_offset + m_chunks.back().payload_bytes;
        m_params.chunk_count = m_chunks.size();
        m_params.group_count = groups;
    }

    void distribute(GscWriter& writer)
    {
        writer.reserveAnchors(m_anchors_bytes);
        distributeAnchors(m_source, m_scan, m_partition, m_params, m_chunks, m_budget / 2, writer,
                          [&](uint64_t done) { tell(done, m_scan.rows); });
    }

    void buildChunks(GscWriter& writer)
    {
        m_groups.resize(m_params.group_count);
        m_index.resize(m_scan.kept);
        m_chunk_leaves.resize(m_chunks.size());
        const uint32_t record_bytes = anchorRecordLayout(m_params).bytes;
        std::atomic<uint64_t> done{0};
        std::atomic<double> sensitivity_seconds{0};
        if (!(m_checkpoint.metre.units > 0))
            m_metre_finder.emplace(m_params, m_partition, m_scan.kept);
        if (m_options.sensitivity != SensitivityMode::None)
            m_sensitivity.emplace(m_checkpoint, m_params, m_rows, m_scan.kept);
        m_workers.run(m_chunks.size(), 1, [&](size_t first, size_t end, int) {
            for (size_t c = first; c != end; ++c) {
                throwIfInterrupted();
                ChunkRecord& chunk = m_chunks[c];
                std::vector<std::byte> records(size_t(chunk.anchor_count) * record_bytes);
                std::vector<std::byte> payload(chunk.payload_bytes);
                writer.readAnchors(chunk.payload_offset, records);
                buildChunk(m_params, m_partition.levels[chunk.level_index], uint32_t(c), records, chunk, payload,
                           std::span(m_groups).subspan(chunk.group_first, chunk.group_count), m_chunk_leaves[c],
                           m_index);
                writer.writeAnchors(chunk.payload_offset, payload);
                if (m_metre_finder)
                    m_metre_finder->addChunk(c, chunk, payload);
                if (m_sensitivity)
                    sensitivity_seconds +=
                        m_sensitivity->addChunk(m_partition.levels[chunk.level_index].level, payload, chunk,
                                                std::span(m_groups).subspan(chunk.group_first, chunk.group_count));
                tell(done += chunk.anchor_count, m_scan.kept);
            }
        });
        m_report.sensitivity_seconds = sensitivity_seconds;
    }

    // Builds sections LEVL, LEAF and NVDB.
    void buildIndex()
    {
        uint64_t leaf_count = 0;
        for (size_t c = 0; c < m_chunks.size(); ++c) {
            m_chunks[c].leaf_first = uint32_t(leaf_count);
            leaf_count += m_chunks[c].leaf_count;
        }
        m_params.leaf_count = leaf_count;
        m_leaves.reserve(leaf_count);
        for (LevelRecord level : m_partition.levels) {
            throwIfInterrupted();
            level.anchor_first = m_chunks[level.chunk_first].anchor_first;
            level.group_first = m_chunks[level.chunk_first].group_first;
            level.leaf_first = m_leaves.size();
            std::vector<LeafBuild> leaves;
            for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c) {
                leaves.insert(leaves.end(), m_chunk_leaves[c].begin(), m_chunk_leaves[c].end());
                m_chunk_leaves[c] = {};
                level.group_count += m_chunks[c].group_count;
            }
            level.leaf_count = leaves.size();
            level.nanovdb_offset = m_nanovdb.size();
            const std::vector<std::byte> grid =
                m_spatial.build(level, m_partition.encoding, leaves, throwIfInterrupted);
            level.nanovdb_bytes = grid.size();
            m_nanovdb.insert(m_nanovdb.end(), grid.begin(), grid.end());
            for (const LeafBuild& leaf : leaves)
                m_leaves.push_back(leaf.record);
            m_levels.push_back(level);
            tell(m_levels.size(), m_partition.levels.size());
        }
    }

    void writeSections(GscWriter& writer)
    {
        const std::string effective = effectiveOptions(m_options);
        ManifestFacts facts{};
        facts.checkpoint = &m_checkpoint;
        facts.options = &m_options;
        facts.params = &m_params;
        facts.source_rows = m_scan.rows;
        facts.dropped = m_scan.dropped.size();
        facts.source_hash = m_hash.hash;
        facts.config_hash = checksum64(std::as_bytes(std::span(effective)));
        facts.embedding_rows = m_rows;
        facts.metre = m_report.metre;
        if (m_sensitivity)
            facts.sensitivity = m_sensitivity->records();
        const std::string manifest = manifestText(facts);

        writer.addSection(kSectionMeta, std::as_bytes(std::span(manifest)), 0);
        writer.addSection(kSectionParams, std::as_bytes(std::span(&m_params, 1)), 1);
        const auto add = [&writer](uint32_t type, const auto& records) {
            writer.addSection(type, std::as_bytes(std::span(records)), records.size());
        };
        add(kSectionLevels, m_levels);
        add(kSectionChunks, m_chunks);
        add(kSectionGroups, m_groups);
        add(kSectionLeaves, m_leaves);
        writer.addSection(kSectionNanoVdb, m_nanovdb, m_levels.size());
        add(kSectionIndex, m_index);
        if (m_sensitivity)
            writer.addSection(kSectionSensitivity, std::as_bytes(m_sensitivity->records()), m_scan.kept,
                              kSectionOptional);
        if (m_options.source && !m_options.source->tile.empty())
            writer.addSection(kSectionTile, m_options.source->tile, m_scan.kept, kSectionOptional);
        writer.addSection(kSectionWeights, canonicalMlps(m_checkpoint.mlps), m_checkpoint.mlps.size());
        writer.addSection(kSectionPacked,
                          packMlps(m_checkpoint.mlps, m_checkpoint.feat_dim, m_checkpoint.appearance_dim), 1);
        if (!m_rows.empty())
            writer.addSection(kSectionEmbedding, embeddingSection(m_checkpoint, m_rows), m_rows.size());
        if (!m_checkpoint.cameras.empty())
            writer.addSection(kSectionCameras, cameraSection(m_checkpoint), m_checkpoint.cameras.size());

        FileHeader header{};
        header.anchor_count = m_scan.kept;
        header.source_hash = m_hash.hash;
        header.config_hash = facts.config_hash;
        header.profile = uint8_t(Profile::Runtime);
        std::vector<uint64_t> checksums;
        for (const ChunkRecord& chunk : m_chunks)
            checksums.push_back(chunk.checksum);
        m_report.output_bytes = writer.finish(header, checksum64(std::as_bytes(std::span(checksums))));
        m_report.anchors = m_scan.kept;
        m_report.dropped = m_scan.dropped.size();
        m_report.levels = m_levels.size();
        m_report.chunks = m_chunks.size();
        m_report.groups = m_groups.size();
        m_report.leaves = m_leaves.size();
    }

    const Checkpoint& m_checkpoint;
    AnchorSource& m_source;
    const WriteOptions& m_options;
    const WriteProgress& m_progress;
    // loaded before any work, so that a missing module is noticed at once
    const SpatialIndexFunctions& m_spatial =
        loadModule<SpatialIndexFunctions>("gsc_index_openvdb", kSpatialIndexThreads);
    const uint64_t m_budget;
    // declared after m_spatial, because loading that module fails where no thread can be started
    const Workers m_workers;
    const std::thread::id m_thread = std::this_thread::get_id();
    const char* m_stage = "";
    WriteReport m_report;

    std::vector<uint32_t> m_rows; // numbers of the rows of the appearance embedding that are kept
    ScanResult m_scan;
    SourceHash m_hash;
    Partition m_partition;
    ModelParams m_params{};
    uint64_t m_anchors_bytes = 0;
    std::vector<ChunkRecord> m_chunks;
    std::vector<std::vector<LeafBuild>> m_chunk_leaves;
    std::vector<GroupRecord> m_groups;
    std::vector<uint32_t> m_index;
    std::optional<SensitivitySampler> m_sensitivity;
    std::optional<MetreFinder> m_metre_finder; // none if the checkpoint states a metre
    std::vector<LevelRecord> m_levels;
    std::vector<LeafRecord> m_leaves;
    std::vector<std::byte> m_nanovdb;
};

} // namespace

WriteReport writeGscFrom(const Checkpoint& checkpoint, AnchorSource& source, const WriteOptions& options,
                         const WriteProgress& progress)
{
    try {
        WriteReport report;
        // the calling thread counts as one of the threads of the arena, in which OpenVDB's own loops run, too
        std::optional<tbb::global_control> limit;
        // many more threads than processors do not finish earlier
        const int processors = usableProcessors();
        const int threads = options.threads > 0 ? std::min(options.threads, 4 * processors) : processors;
        const int tbb_threads = threads > 1 && boundTbb(threads) ? 1 : threads;
        limit.emplace(tbb::global_control::max_allowed_parallelism, size_t(tbb_threads));
        tbb::task_arena arena(tbb_threads);
        arena.execute([&] { report = Writer(checkpoint, source, options, threads, progress).run(); });
        return report;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorCode::OutOfMemory, checkpoint.model_path, "not enough memory to convert it",
                    "enough for --memory-budget", "try a smaller --memory-budget or --chunk-anchors");
    }
}

WriteReport writeGsc(const Checkpoint& checkpoint, const WriteOptions& options, const WriteProgress& progress)
{
    const std::unique_ptr<AnchorSource> source = openAnchors(checkpoint);
    return writeGscFrom(checkpoint, *source, options, progress);
}

} // namespace gsc
