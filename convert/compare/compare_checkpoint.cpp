// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/compare_checkpoint.h"

#include "format/numbers/count_text.h"
#include "convert/input/model_names.h"
#include "convert/survey/chunk_values.h"
#include "convert/write/anchor_check.h"
#include "convert/write/anchor_record.h"
#include "convert/write/batch_stream.h"
#include "convert/write/mlp_pack.h"
#include "convert/write/model_sections.h"
#include <gsc/error.h>
#include <gsc/gsc_file.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>

namespace gsc {

namespace {

// Counts values that differ in any bit: -0.0 and +0.0 differ, equal NaNs do not. `place`: index of the first value, or
// with `per_element` false of the anchor.
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

// Value of all anchors in an array that the file does not store because it is constant.
const float* constantOf(const ModelParams& params, ChunkArray array)
{
    static constexpr float kZero[3] = {};
    return array == ChunkArray::Rotation  ? params.constant_rotation
           : array == ChunkArray::Opacity ? &params.constant_opacity
                                          : kZero;
}

class Comparison {
public:
    Comparison(const Checkpoint& checkpoint, const GscView& view, const WriteProgress& progress)
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
        static const nlohmann::json::json_pointer kPlace("/source/dropped");
        const nlohmann::json manifest = nlohmann::json::parse(m_view.manifest, nullptr, false);
        if (manifest.is_object() && manifest.contains(kPlace) && manifest[kPlace].is_number_unsigned())
            m_report.dropped = manifest[kPlace].get<uint64_t>();
        if (manifest.is_object() && manifest.contains("reduction"))
            m_report.reduction = manifest["reduction"].dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
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

    // Returns false if numbers of features, Gaussians or MLPs differ, so that values cannot be compared.
    bool compareSettings()
    {
        const ModelParams expected = modelParams(m_checkpoint), &file = *m_view.params;
        // the writer sets these by the values
        constexpr uint32_t kFound = kModelHasRotation | kModelHasOpacity | kModelHasNormal;
        same("family", expected.family, file.family);
        same("flags", expected.flags & ~kFound, file.flags & ~kFound);
        same("level_rule", expected.level_rule, file.level_rule);
        same("fork", expected.fork, file.fork);
        same("level_clamp", expected.level_clamp, file.level_clamp);
        same("standard_dist", expected.standard_dist, file.standard_dist);
        same("lod_scale", expected.lod_scale, file.lod_scale);
        if (expected.voxel_size > 0) // without levels it only tells how the file stores positions
            same("voxel_size", expected.voxel_size, file.voxel_size);
        same("raster_rules", expected.raster_rules, file.raster_rules);
        same("near_z", expected.near_z, file.near_z);
        bool shapes = same("feat_dim", expected.feat_dim, file.feat_dim);
        shapes = same("n_offsets", expected.n_offsets, file.n_offsets) && shapes;
        shapes = same("appearance_dim", expected.appearance_dim, file.appearance_dim) && shapes;
        shapes = same("mlp_count", expected.mlp_count, file.mlp_count) && shapes;
        return shapes;
    }

    // Chunk that holds an anchor. `last`: the one found before, tried first, because neighbours in the checkpoint are
    // often neighbours in the file.
    const ChunkRecord& chunkOf(uint32_t anchor, const ChunkRecord* last) const
    {
        if (last && anchor >= last->anchor_first && anchor - last->anchor_first < last->anchor_count)
            return *last;
        return *std::prev(
            std::upper_bound(m_view.chunks.begin(), m_view.chunks.end(), anchor,
                             [](uint32_t value, const ChunkRecord& chunk) { return value < chunk.anchor_first; }));
    }

    void compareAnchors(AnchorSource& source)
    {
        constexpr size_t kFirstCopied = 2;
        std::vector<AttributeDifference> found(kFirstCopied + std::size(kCopiedArrays) + 1);
        AttributeDifference &position = found[0], &level = found[1], &source_index = found.back();
        position.name = "position";
        level.name = "level";
        source_index.name = "source_index";
        for (size_t c = 0; c < std::size(kCopiedArrays); ++c)
            found[kFirstCopied + c].name = kCopiedArrays[c].name;
        const ModelParams& p = *m_view.params;
        const ChunkRecord* chunk = nullptr;
        std::optional<ChunkValues> file;
        uint64_t row = 0, skipped = 0, total = 0;
        forEachBatch(source, kAnchorAll, [&](const AnchorBatch& batch) {
            std::array<size_t, std::size(kCopiedArrays)> width;
            for (size_t c = 0; c < width.size(); ++c)
                width[c] = (batch.*kCopiedArrays[c].values).size() / std::max<size_t>(batch.count, 1);
            for (size_t i = 0; i < batch.count; ++i) {
                if (m_report.dropped &&
                    findAnchorFault(batch, i, p.feat_dim, p.n_offsets, false) != AnchorFault::None) {
                    ++skipped;
                    continue;
                }
                const uint64_t id = row++;
                if (id >= m_view.index.size())
                    continue;
                const uint32_t anchor = m_view.index[id];
                if (const ChunkRecord& holder = chunkOf(anchor, chunk); &holder != chunk) {
                    chunk = &holder;
                    file.emplace(m_view, holder);
                }
                const uint32_t local = anchor - chunk->anchor_first;
                const uint32_t stored_source = file->source(local), wanted = uint32_t(id);
                compareValues(position, &batch.position[3 * i], file->position(local).data(), 3, id, false);
                compareValues(level, &batch.level[i], &m_view.levels[chunk->level_index].level, 1, id, false);
                compareValues(source_index, &wanted, &stored_source, 1, id, false);
                for (size_t c = 0; c < width.size(); ++c) {
                    const CopiedArray& copied = kCopiedArrays[c];
                    const float* stored = file->values(copied.array, local);
                    compareValues(found[kFirstCopied + c], (batch.*copied.values).data() + width[c] * i,
                                  stored ? stored : constantOf(p, copied.array), width[c], id, false);
                }
            }
            total += batch.count;
            // batches come on several threads, but callers are promised one
            if (m_progress && std::this_thread::get_id() == m_thread)
                m_progress("compare", total, m_checkpoint.anchor_count);
        });
        m_report.anchors = std::min<uint64_t>(row, m_view.index.size());
        if (row != m_view.index.size())
            problem(formatString("the checkpoint has %s, the file %s", formatCount(row, "anchor").c_str(),
                                 formatCount(m_view.index.size()).c_str()));
        if (skipped != m_report.dropped)
            problem(formatString("%s of the checkpoint cannot be shown, the file left out %s",
                                 formatCount(skipped, "anchor").c_str(), formatCount(m_report.dropped).c_str()));
        m_report.attributes.insert(m_report.attributes.end(), found.begin(), found.end());
    }

    void compareMlps()
    {
        for (size_t m = 0; m < m_checkpoint.mlps.size() && m < m_view.mlps.size(); ++m) {
            const Mlp& mlp = m_checkpoint.mlps[m];
            const MlpRecord& record = m_view.mlps[m];
            if (uint32_t(mlp.kind) != record.kind || uint32_t(mlp.activation) != record.activation ||
                mlp.inputs != record.inputs || mlp.layers[0].in != record.in || mlp.layers[0].out != record.hidden ||
                mlp.layers[1].out != record.out) {
                problem(formatString("%s has another shape, input or activation in the file", kMlpNames[m]));
                continue;
            }
            const auto array = [&](const char* name, const std::vector<float>& values, uint64_t offset) {
                elements(std::string(kMlpNames[m]) + "." + name, values.data(),
                         reinterpret_cast<const float*>(m_view.weights.data() + offset), values.size());
            };
            array("weight0", mlp.layers[0].weight, record.weight0);
            array("bias0", mlp.layers[0].bias, record.bias0);
            array("weight1", mlp.layers[1].weight, record.weight1);
            array("bias1", mlp.layers[1].bias, record.bias1);
        }
        if (!std::ranges::equal(packMlps(m_checkpoint.mlps, m_checkpoint.feat_dim, m_checkpoint.appearance_dim),
                                m_view.packed))
            problem("the packed weights are not those of the checkpoint's mlps");
    }

    void compareEmbedding()
    {
        const uint32_t columns = m_checkpoint.appearance_dim, rows = m_checkpoint.embeddingRows();
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
            problem(formatString("the checkpoint has %s, the file %s",
                                 formatCount(m_checkpoint.cameras.size(), "camera").c_str(),
                                 formatCount(m_view.cameras.size()).c_str()));
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

    // Compares `count` values as part of the attribute `name`, which may have been begun by another call.
    template <typename T>
    void elements(const std::string& name, const T* a, const T* b, size_t count)
    {
        std::vector<AttributeDifference>& all = m_report.attributes;
        auto known = std::find_if(all.begin(), all.end(), [&](const AttributeDifference& x) { return x.name == name; });
        if (known == all.end())
            known = all.insert(known, {name});
        compareValues(*known, a, b, count, known->compared, true);
    }

    const Checkpoint& m_checkpoint;
    const GscView& m_view;
    const WriteProgress& m_progress;
    const std::thread::id m_thread = std::this_thread::get_id();
    CompareReport m_report;
};

} // namespace

std::string CompareReport::summary() const
{
    std::string text;
    for (const AttributeDifference& a : attributes)
        if (a.different)
            text += formatString("%s%s of %s of %s differ, by %g at most, first at %llu", text.empty() ? "" : "; ",
                                 formatCount(a.different).c_str(), formatCount(a.compared, "value").c_str(),
                                 a.name.c_str(), a.max_abs, (unsigned long long)a.first);
    for (const std::string& p : problems)
        text += (text.empty() ? "" : "; ") + p;
    return text.empty() ? "no difference" : text;
}

CompareReport compareCheckpoint(const Checkpoint& checkpoint, AnchorSource& source, const GscView& view,
                                const WriteProgress& progress)
{
    return Comparison(checkpoint, view, progress).run(source);
}

CompareReport compareCheckpoint(const Checkpoint& checkpoint, const std::string& gsc_path,
                                const WriteProgress& progress)
{
    const IssueSink sink = throwFirstIssue(gsc_path);
    const GscFile file(gsc_path, sink);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Index, sink);
    const std::unique_ptr<AnchorSource> source = openAnchors(checkpoint);
    return compareCheckpoint(checkpoint, *source, view, progress);
}

} // namespace gsc
