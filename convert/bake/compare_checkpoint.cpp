// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/compare_checkpoint.h"

#include "convert/bake/anchor_check.h"
#include "convert/bake/batch_stream.h"
#include "convert/bake/mlp_pack.h"
#include "convert/bake/model_sections.h"
#include "format/error.h"
#include "format/file/mapped_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>

namespace gsc {

namespace {

constexpr size_t kBatchRows = 8192;

// Bit for bit, so that -0.0 and +0.0 differ and equal NaNs do not.
template <typename T>
void compareValues(AttributeDifference& result, const T* a, const T* b, size_t count, uint64_t place, bool per_element)
{
    result.compared += count;
    if (std::memcmp(a, b, count * sizeof(T)) == 0)
        return;
    for (size_t i = 0; i < count; ++i) {
        if (std::memcmp(a + i, b + i, sizeof(T)) == 0)
            continue;
        if (result.different++ == 0)
            result.first = per_element ? place + i : place;
        const double difference = std::fabs(double(a[i]) - double(b[i]));
        result.max_abs = std::max(result.max_abs, std::isnan(difference) ? double(INFINITY) : difference);
    }
}

// Reads the anchors of a file by source index.
class FileAnchors {
public:
    explicit FileAnchors(const GscView& view) : m_view(view) {}

    void select(uint32_t anchor)
    {
        if (!m_chunk || anchor < m_chunk->anchor_first || anchor - m_chunk->anchor_first >= m_chunk->anchor_count) {
            m_chunk = &*std::prev(
                std::upper_bound(m_view.chunks.begin(), m_view.chunks.end(), anchor,
                                 [](uint32_t value, const ChunkRecord& chunk) { return value < chunk.anchor_first; }));
            m_layout = chunkArrayLayout(*m_view.params, m_chunk->anchor_count);
            m_payload = chunkPayload(m_view, *m_chunk);
        }
        m_local = anchor - m_chunk->anchor_first;
    }

    [[nodiscard]] const float* floats(ChunkArray array) const
    {
        const uint32_t a = uint32_t(array);
        if (m_layout.stride[a] == 0)
            return nullptr;
        return reinterpret_cast<const float*>(m_payload.data() + m_layout.offset[a] + m_layout.stride[a] * m_local);
    }

    [[nodiscard]] const LevelRecord& level() const { return m_view.levels[m_chunk->level_index]; }

    [[nodiscard]] uint32_t sourceIndex() const
    {
        uint32_t value;
        std::memcpy(&value, floats(ChunkArray::SourceIndex), sizeof(value));
        return value;
    }

    void position(float out[3]) const
    {
        const float* stored = floats(ChunkArray::Position);
        if (m_view.params->position_encoding == uint32_t(PositionEncoding::Float)) {
            std::copy_n(stored, 3, out);
            return;
        }
        GridPosition grid;
        std::memcpy(&grid, stored, sizeof(grid));
        for (int axis = 0; axis < 3; ++axis)
            out[axis] = gridCoordinate(m_chunk->origin[axis] + grid.local[axis], level().quantum, level().origin,
                                       grid.flags & (kNegativeZeroX << axis));
    }

private:
    const GscView& m_view;
    const ChunkRecord* m_chunk = nullptr;
    ChunkArrayLayout m_layout{};
    std::span<const std::byte> m_payload;
    uint32_t m_local = 0;
};

class Comparison {
public:
    Comparison(const Checkpoint& checkpoint, const GscView& view, const BakeProgress& progress)
        : m_checkpoint(checkpoint), m_view(view), m_progress(progress)
    {
    }

    CompareReport run(AnchorSource& source)
    {
        readManifest();
        if (compareSettings()) {
            compareAnchors(source);
            compareMlps();
            compareEmbedding();
        }
        compareCameras();
        m_report.equal =
            m_report.problems.empty() && std::all_of(m_report.attributes.begin(), m_report.attributes.end(),
                                                     [](const AttributeDifference& a) { return a.different == 0; });
        return std::move(m_report);
    }

private:
    void readManifest()
    {
        const nlohmann::json manifest = nlohmann::json::parse(m_view.manifest, nullptr, false);
        if (manifest.is_object() && manifest.contains("source") && manifest["source"].is_object() &&
            manifest["source"].contains("dropped") && manifest["source"]["dropped"].is_number_unsigned())
            m_report.dropped = manifest["source"]["dropped"].get<uint64_t>();
    }

    void problem(std::string text) { m_report.problems.push_back(std::move(text)); }

    template <typename T>
    bool same(const char* name, T checkpoint, T file)
    {
        if (std::memcmp(&checkpoint, &file, sizeof(T)) == 0)
            return true;
        problem(
            formatString("%s is %.9g in the checkpoint and %.9g in the file", name, double(checkpoint), double(file)));
        return false;
    }

    // False if the shapes differ so that values cannot be compared.
    bool compareSettings()
    {
        const ModelParams expected = modelParams(m_checkpoint), &file = *m_view.params;
        constexpr uint32_t kFound = kModelHasRotation | kModelHasOpacity | kModelHasNormal; // decided while baking
        same("family", expected.family, file.family);
        same("flags", expected.flags & ~kFound, file.flags & ~kFound);
        same("level_rule", expected.level_rule, file.level_rule);
        same("fork", expected.fork, file.fork);
        same("level_clamp", expected.level_clamp, file.level_clamp);
        same("standard_dist", expected.standard_dist, file.standard_dist);
        same("lod_scale", expected.lod_scale, file.lod_scale);
        if (expected.voxel_size > 0) // else it is the positions' own
            same("voxel_size", expected.voxel_size, file.voxel_size);
        same("raster_rules", expected.raster_rules, file.raster_rules);
        same("near_z", expected.near_z, file.near_z);
        bool shapes = same("feat_dim", expected.feat_dim, file.feat_dim);
        shapes = same("n_offsets", expected.n_offsets, file.n_offsets) && shapes;
        shapes = same("appearance_dim", expected.appearance_dim, file.appearance_dim) && shapes;
        shapes = same("mlp_count", expected.mlp_count, file.mlp_count) && shapes;
        return shapes;
    }

    void compareAnchors(AnchorSource& source)
    {
        enum {
            kPosition,
            kLevel,
            kExtraLevel,
            kScale,
            kOffset,
            kFeature,
            kRotation,
            kOpacity,
            kNormal,
            kSource,
            kKinds
        };
        static const char* const kNames[kKinds] = {"position", "level",    "extra_level", "scale",  "offset",
                                                   "feature",  "rotation", "opacity",     "normal", "source_index"};
        std::array<AttributeDifference, kKinds> found;
        for (int i = 0; i < kKinds; ++i)
            found[i].name = kNames[i];
        const ModelParams& p = *m_view.params;
        const float zero[3] = {0, 0, 0};
        FileAnchors file(m_view);
        uint64_t row = 0, skipped = 0, total = 0;
        forEachBatch(source, kAnchorAll, kBatchRows, [&](const AnchorBatch& batch) {
            for (size_t i = 0; i < batch.count; ++i) {
                if (m_report.dropped && findAnchorFault(batch, i, p.feat_dim, p.n_offsets) != AnchorFault::None) {
                    ++skipped;
                    continue;
                }
                const uint64_t id = row++;
                if (id >= m_view.index.size())
                    continue;
                file.select(m_view.index[id]);
                const auto floats = [&](int kind, const float* a, const float* b, size_t count) {
                    compareValues(found[kind], a, b, count, id, false);
                };
                const auto stored = [&](ChunkArray array, const float* constant) {
                    const float* values = file.floats(array);
                    return values ? values : constant;
                };
                float position[3];
                file.position(position);
                const uint32_t index = file.sourceIndex(), wanted = uint32_t(id);
                floats(kPosition, &batch.position[3 * i], position, 3);
                compareValues(found[kLevel], &batch.level[i], &file.level().level, 1, id, false);
                compareValues(found[kSource], &wanted, &index, 1, id, false);
                floats(kExtraLevel, &batch.extra_level[i], stored(ChunkArray::ExtraLevel, zero), 1);
                floats(kScale, &batch.scale[6 * i], file.floats(ChunkArray::Scale), 6);
                floats(kOffset, &batch.offset[3 * size_t(p.n_offsets) * i], file.floats(ChunkArray::Offset),
                       3 * size_t(p.n_offsets));
                floats(kFeature, &batch.feature[size_t(p.feat_dim) * i], file.floats(ChunkArray::Feature), p.feat_dim);
                floats(kRotation, &batch.rotation[4 * i], stored(ChunkArray::Rotation, p.constant_rotation), 4);
                floats(kOpacity, &batch.opacity[i], stored(ChunkArray::Opacity, &p.constant_opacity), 1);
                floats(kNormal, &batch.normal[3 * i], stored(ChunkArray::Normal, zero), 3);
            }
            total += batch.count;
            if (m_progress && std::this_thread::get_id() == m_thread) // batches come from several threads
                m_progress("compare", total, m_checkpoint.anchor_count);
        });
        m_report.anchors = std::min<uint64_t>(row, m_view.index.size());
        if (row != m_view.index.size())
            problem(formatString("the checkpoint has %llu anchors, the file %llu", (unsigned long long)row,
                                 (unsigned long long)m_view.index.size()));
        if (skipped != m_report.dropped)
            problem(formatString("%llu anchors of the checkpoint cannot be shown, the file left out %llu",
                                 (unsigned long long)skipped, (unsigned long long)m_report.dropped));
        m_report.attributes.insert(m_report.attributes.end(), found.begin(), found.end());
    }

    void compareMlps()
    {
        static const char* const kMlps[] = {"opacity_mlp", "cov_mlp", "color_mlp", "feature_bank_mlp"};
        for (size_t m = 0; m < m_checkpoint.mlps.size() && m < m_view.mlps.size(); ++m) {
            const Mlp& mlp = m_checkpoint.mlps[m];
            const MlpRecord& record = m_view.mlps[m];
            if (uint32_t(mlp.kind) != record.kind || uint32_t(mlp.activation) != record.activation ||
                mlp.inputs != record.inputs || mlp.layers[0].in != record.in || mlp.layers[0].out != record.hidden ||
                mlp.layers[1].out != record.out) {
                problem(formatString("%s has another shape, input or activation in the file", kMlps[m]));
                continue;
            }
            const std::pair<const std::vector<float>*, uint64_t> arrays[] = {{&mlp.layers[0].weight, record.weight0},
                                                                             {&mlp.layers[0].bias, record.bias0},
                                                                             {&mlp.layers[1].weight, record.weight1},
                                                                             {&mlp.layers[1].bias, record.bias1}};
            static const char* const kArrays[] = {"weight0", "bias0", "weight1", "bias1"};
            for (int a = 0; a < 4; ++a)
                elements(std::string(kMlps[m]) + "." + kArrays[a], arrays[a].first->data(),
                         reinterpret_cast<const float*>(m_view.weights.data() + arrays[a].second),
                         arrays[a].first->size());
        }
        const std::vector<std::byte> packed =
            packMlps(m_checkpoint.mlps, m_checkpoint.feat_dim, m_checkpoint.appearance_dim);
        if (packed.size() != m_view.packed.size() ||
            std::memcmp(packed.data(), m_view.packed.data(), packed.size()) != 0)
            problem("the packed weights are not those of the checkpoint's mlps");
    }

    void compareEmbedding()
    {
        const uint32_t columns = m_checkpoint.appearance_dim;
        const uint32_t rows = columns ? uint32_t(m_checkpoint.embedding.size() / columns) : 0;
        if (columns == 0)
            return;
        for (size_t i = 0; i < m_view.embedding_rows.size(); ++i) {
            const uint32_t row = m_view.embedding_rows[i];
            if (row >= rows)
                problem(formatString("the file keeps row %u of an embedding of %u rows", row, rows));
            else
                elements("embedding", &m_checkpoint.embedding[size_t(row) * columns], &m_view.embedding[i * columns],
                         columns);
        }
    }

    void compareCameras()
    {
        if (m_checkpoint.cameras.size() != m_view.cameras.size()) {
            problem(formatString("the checkpoint has %zu cameras, the file %zu", m_checkpoint.cameras.size(),
                                 m_view.cameras.size()));
            return;
        }
        for (size_t i = 0; i < m_view.cameras.size(); ++i) {
            const SourceCamera& camera = m_checkpoint.cameras[i];
            const CameraRecord& record = m_view.cameras[i];
            elements("camera.position", camera.position, record.position, 3);
            elements("camera.rotation", camera.rotation, record.rotation, 9);
            const double focal[2] = {camera.fx, camera.fy}, stored[2] = {record.fx, record.fy};
            elements("camera.focal", focal, stored, 2);
            const uint32_t integers[] = {camera.width, camera.height, uint32_t(camera.id), uint32_t(camera.appearance),
                                         camera.is_test ? 1u : 0u};
            const uint32_t in_file[] = {record.width, record.height, uint32_t(record.id), uint32_t(record.appearance),
                                        record.is_test};
            elements("camera.size_and_ids", integers, in_file, 5);
            if (m_view.camera_names.substr(record.name_offset, record.name_bytes) != camera.name)
                problem(formatString("camera %zu has another name in the file", i));
        }
    }

    // Consecutive calls with the same name continue one attribute.
    template <typename T>
    void elements(const std::string& name, const T* a, const T* b, size_t count)
    {
        if (m_report.attributes.empty() || m_report.attributes.back().name != name) {
            const auto known = std::find_if(m_report.attributes.begin(), m_report.attributes.end(),
                                            [&](const AttributeDifference& x) { return x.name == name; });
            if (known != m_report.attributes.end()) {
                compareValues(*known, a, b, count, known->compared, true);
                return;
            }
            m_report.attributes.emplace_back().name = name;
        }
        AttributeDifference& result = m_report.attributes.back();
        compareValues(result, a, b, count, result.compared, true);
    }

    const Checkpoint& m_checkpoint;
    const GscView& m_view;
    const BakeProgress& m_progress;
    const std::thread::id m_thread = std::this_thread::get_id();
    CompareReport m_report;
};

} // namespace

std::string CompareReport::summary() const
{
    std::string text;
    for (const AttributeDifference& a : attributes)
        if (a.different)
            text +=
                formatString("%s%llu of %llu values of %s differ, by %g at most, first at %llu",
                             text.empty() ? "" : "; ", (unsigned long long)a.different, (unsigned long long)a.compared,
                             a.name.c_str(), a.max_abs, (unsigned long long)a.first);
    for (const std::string& p : problems)
        text += (text.empty() ? "" : "; ") + p;
    return text.empty() ? "no difference" : text;
}

CompareReport compareCheckpoint(const Checkpoint& checkpoint, AnchorSource& source, const GscView& view,
                                const BakeProgress& progress)
{
    return Comparison(checkpoint, view, progress).run(source);
}

CompareReport compareCheckpoint(const Checkpoint& checkpoint, const std::string& gsc_path, const BakeProgress& progress)
{
    const MappedFile file(gsc_path);
    GscView view;
    std::optional<Issue> first;
    const bool good = openGsc(file.bytes(), view, GscCheck::Index, [&](const Issue& issue) {
        if (!first && issue.info->severity != Severity::Warning)
            first = issue;
    });
    if (!good)
        throwIssue(gsc_path, first);
    const std::unique_ptr<AnchorSource> source = openAnchors(checkpoint);
    return compareCheckpoint(checkpoint, *source, view, progress);
}

} // namespace gsc
