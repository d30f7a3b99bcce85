// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device_scene.h"

#include "kernels/decode/decode_fragments.h"
#include "kernels/math/anchor.h"
#include "kernels/math/lod.h"
#include "kernels/math/mlp.h"
#include "kernels/upload/upload_cuda.h"

#include <algorithm>
#include <vector>

namespace gsc {

namespace {

// Bytes of MLPW from its start to the end of the last array.
uint64_t weightBytes(const ModelView& model)
{
    const auto* records = reinterpret_cast<const MlpRecord*>(model.weights);
    uint64_t end = model.params->mlp_count * sizeof(MlpRecord);
    for (uint32_t i = 0; i < model.params->mlp_count; ++i) {
        const MlpRecord& r = records[i];
        end = std::max<uint64_t>({end, r.weight0 + 4ull * r.in * r.hidden, r.bias0 + 4ull * r.hidden,
                                  r.weight1 + 4ull * r.hidden * r.out, r.bias1 + 4ull * r.out});
    }
    return end;
}

template <typename T>
void copyIn(T* to, const T* from, size_t count, const CudaStream& stream)
{
    if (count != 0)
        GSC_CUDA_CHECK(cudaMemcpyAsync(to, from, count * sizeof(T), cudaMemcpyHostToDevice, stream.handle));
}

// The groups of every chunk, a warp's worth at a time.
std::vector<GroupRun> groupRuns(const ModelView& model)
{
    std::vector<GroupRun> runs;
    for (uint64_t c = 0; c < model.params->chunk_count; ++c) {
        const ChunkRecord& chunk = model.chunks[c];
        GroupRun run{};
        std::copy_n(chunk.anchor_min, 3, run.anchor_min);
        std::copy_n(chunk.anchor_max, 3, run.anchor_max);
        run.anchor_sigma_max = chunk.anchor_sigma_max;
        run.extra_level_max = chunk.extra_level_max;
        run.level_index = uint16_t(chunk.level_index);
        run.gaussian_sigma_max = chunk.gaussian_sigma_max;
        for (int i = 0; i < 3; ++i)
            run.gaussian_margin = std::max({run.gaussian_margin, chunk.anchor_min[i] - chunk.gaussian_min[i],
                                            chunk.gaussian_max[i] - chunk.anchor_max[i]});
        for (uint32_t g = 0; g < chunk.group_count; g += kRunGroups) {
            run.group_first = chunk.group_first + g;
            run.group_count = uint16_t(std::min(chunk.group_count - g, kRunGroups));
            runs.push_back(run);
        }
    }
    return runs;
}

} // namespace

struct DeviceScene::FlatArrays {
    LevelRecord* levels;
    GroupRecord* groups;
    GroupRun* runs;
    AnchorArrays anchors;
    float *lod_shift, *biases, *bank;
    uint32_t* level_first;
    uint16_t* fragments;
    ExactWeights* weights;
};

DeviceScene::FlatArrays DeviceScene::layOutFlat(ArenaLayout& layout, uint64_t anchors, size_t runs) const
{
    const ModelParams& params = *m_host.params;
    FlatArrays a{};
    a.levels = layout.take<LevelRecord>(params.level_count);
    a.groups = layout.take<GroupRecord>(params.group_count);
    a.runs = layout.take<GroupRun>(runs);
    a.lod_shift = layout.take<float>(params.level_count);
    a.level_first = layout.take<uint32_t>(params.level_count);
    a.anchors.placement = layout.take<float>(anchors * 4);
    a.anchors.size = layout.take<float>(anchors * 3);
    a.anchors.shape = layout.take<float>(anchors * 6);
    a.anchors.source = layout.take<uint32_t>(anchors);
    if (params.flags & kModelHasRotation)
        a.anchors.rotation = layout.take<float>(anchors * 4);
    if (m_fast_possible) {
        a.anchors.feature = layout.take<uint16_t>(anchors * params.feat_dim);
        a.anchors.offset = layout.take<uint64_t>(anchors * params.n_offsets);
        a.fragments = layout.take<uint16_t>(size_t(kFragmentTiles) * kTileHalves);
        a.biases = layout.take<float>(kBiasCount);
        if (params.flags & kModelFeatureBank)
            a.bank = layout.take<float>(kBankValues);
        if (canDecodeTiled(m_host))
            a.weights = layout.take<ExactWeights>(1);
    }
    return a;
}

void DeviceScene::load(const ModelView& model, const CudaStream& stream)
{
    m_host = model;
    m_model = {}; // what is thrown below leaves nothing that points into memory given back
    const ModelParams& params = *model.params;
    uint64_t anchors = 0;
    uint32_t last_source = 0; // a model cut down keeps the numbers its anchors had
    std::vector<uint32_t> level_first(params.level_count, UINT32_MAX);
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        const ChunkRecord& chunk = model.chunks[c];
        anchors += chunk.anchor_count;
        level_first[chunk.level_index] = std::min(level_first[chunk.level_index], chunk.anchor_first);
        for (uint32_t i = 0; i < chunk.anchor_count; ++i)
            last_source = std::max(last_source, model.arrays[c].source_index[i]);
    }
    if (anchors >= 1ull << kAnchorBits || (uint64_t(last_source) + 1) * params.n_offsets >= 1ull << 32)
        throw Error(ErrorCode::Unsupported,
                    formatString("cuda: model has %llu anchors numbered to %u, of %u Gaussians each, expected fewer "
                                 "than 2^30 anchors and 2^32 Gaussians; use --backend cpu",
                                 static_cast<unsigned long long>(anchors), last_source, params.n_offsets));
    m_fast_possible = canDecodeFast(model);
    m_exact_loaded = m_weights_ready = false;
    m_exact.release();
    m_origins.release();
    m_inputs = 0;
    for (const MlpKind kind : {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color, MlpKind::FeatureBank})
        if (const MlpRecord* mlp = mlpRecord(model, kind))
            m_inputs |= mlp->inputs;

    const std::vector<GroupRun> runs = groupRuns(model);
    const FlatArrays arrays =
        layOutIn(m_flat, "the model", [&](ArenaLayout& layout) { return layOutFlat(layout, anchors, runs.size()); });
    std::vector<float> shift(params.level_count);
    for (uint32_t l = 0; l < params.level_count; ++l)
        shift[l] = lodShift<float>(params, model.levels[l].level);
    copyIn(arrays.levels, model.levels, params.level_count, stream);
    copyIn(arrays.groups, model.groups, params.group_count, stream);
    copyIn(arrays.runs, runs.data(), runs.size(), stream);
    copyIn(arrays.lod_shift, shift.data(), shift.size(), stream);
    copyIn(arrays.level_first, level_first.data(), level_first.size(), stream);
    const AnchorArrays& of_anchors = arrays.anchors;
    m_model = {params,
               arrays.levels,
               arrays.groups,
               arrays.runs,
               arrays.lod_shift,
               arrays.level_first,
               of_anchors.placement,
               of_anchors.size,
               of_anchors.shape,
               of_anchors.rotation,
               of_anchors.feature,
               of_anchors.offset,
               of_anchors.source,
               uint32_t(runs.size()),
               uint32_t(anchors)};
    m_fragments = arrays.fragments;
    m_biases = arrays.biases;
    m_bank = arrays.bank;
    m_weights = arrays.weights;
    uploadChunks(of_anchors, stream);
}

void DeviceScene::copyArrays(uint64_t chunk, const ChunkArrayLayout& layout, unsigned char* to,
                             const CudaStream& stream) const
{
    const ChunkArrays& arrays = m_host.arrays[chunk];
    const void* position = arrays.grid_position;
    if (position == nullptr)
        position = arrays.float_position;
    // in the order of ChunkArray; null where absent or of no use to a frame
    const void* const from[uint32_t(ChunkArray::Count)] = {position,       arrays.source_index, arrays.extra_level,
                                                           arrays.scale,   arrays.offset,       arrays.feature,
                                                           arrays.rotation};
    for (uint32_t a = 0; a < uint32_t(ChunkArray::Count); ++a)
        if (layout.stride[a] != 0 && from[a] != nullptr)
            GSC_CUDA_CHECK(cudaMemcpyAsync(to + layout.offset[a], from[a],
                                           layout.stride[a] * m_host.chunks[chunk].anchor_count, cudaMemcpyHostToDevice,
                                           stream.handle));
}

void DeviceScene::uploadChunks(const AnchorArrays& to, const CudaStream& stream)
{
    const ModelParams& params = m_model.params;
    size_t largest = 0;
    for (uint64_t c = 0; c < params.chunk_count; ++c)
        largest = std::max<size_t>(largest, chunkArrayLayout(params, m_host.chunks[c].anchor_count).bytes);
    m_staging.reserve(std::max<size_t>(largest, 1), "a chunk on its way");
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        const ChunkRecord& chunk = m_host.chunks[c];
        const ChunkArrayLayout layout = chunkArrayLayout(params, chunk.anchor_count);
        copyArrays(c, layout, m_staging.get(), stream);
        uploadCuda({chunk, m_host.levels[chunk.level_index], layout, m_staging.get(), params.feat_dim, params.n_offsets,
                    params.position_encoding == uint32_t(PositionEncoding::Grid), to},
                   stream.handle);
    }
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle));
    m_staging.release();
}

void DeviceScene::loadOrigins(const CudaStream& stream)
{
    if (m_origins.bytes() != 0)
        return;
    std::vector<uint32_t> origins(1);
    for (uint64_t g = 0; g < m_model.params.group_count; ++g) {
        const GroupRecord& group = m_host.groups[g];
        const uint32_t* sources =
            m_host.arrays[group.chunk].source_index + (group.anchor_first - m_host.chunks[group.chunk].anchor_first);
        for (uint32_t i = 0; i < group.anchor_count; ++i) {
            if (sources[i] >= origins.size())
                origins.resize(size_t(sources[i]) + sources[i] / 2 + 1);
            origins[sources[i]] = uint32_t(g) * kGroupSize + i;
        }
    }
    m_origins.reserve(origins.size() * sizeof(uint32_t), "where the anchors of false colours lie");
    copyIn(reinterpret_cast<uint32_t*>(m_origins.get()), origins.data(), origins.size(), stream);
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // the copy's source goes out of scope
}

void DeviceScene::loadExact(const CudaStream& stream)
{
    if (m_exact_loaded)
        return;
    const ModelParams& params = m_model.params;
    uint64_t payload_bytes = 0;
    for (uint64_t c = 0; c < params.chunk_count; ++c)
        payload_bytes += alignUp(chunkArrayLayout(params, m_host.chunks[c].anchor_count).bytes, kPayloadAlign);
    const size_t weight_bytes = weightBytes(m_host);
    const size_t embedding_values =
        m_host.embedding != nullptr ? size_t(params.appearance_rows) * params.appearance_dim : 0;

    struct Arrays {
        unsigned char *payloads, *mlps;
        ModelParams* params;
        ChunkRecord* chunks;
        ChunkArrays* arrays;
        float* embedding;
    };
    const auto layOut = [&](ArenaLayout& layout) {
        return Arrays{layout.take<unsigned char>(payload_bytes),
                      layout.take<unsigned char>(weight_bytes),
                      layout.take<ModelParams>(1),
                      layout.take<ChunkRecord>(params.chunk_count),
                      layout.take<ChunkArrays>(params.chunk_count),
                      layout.take<float>(embedding_values)};
    };
    const Arrays device = layOutIn(m_exact, "the model in fp32", layOut);

    std::vector<ChunkArrays> arrays(params.chunk_count);
    unsigned char* to = device.payloads;
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        const uint32_t count = m_host.chunks[c].anchor_count;
        const ChunkArrayLayout layout = chunkArrayLayout(params, count);
        copyArrays(c, layout, to, stream);
        arrays[c] = chunkArrays(params, count, reinterpret_cast<const std::byte*>(to));
        to += alignUp(layout.bytes, kPayloadAlign);
    }
    copyIn(device.arrays, arrays.data(), arrays.size(), stream);
    copyIn(device.params, &params, 1, stream);
    copyIn(device.chunks, m_host.chunks, params.chunk_count, stream);
    copyIn(device.mlps, reinterpret_cast<const unsigned char*>(m_host.weights), weight_bytes, stream);
    copyIn(device.embedding, m_host.embedding, embedding_values, stream);
    m_exact_view = {device.params, m_model.levels,
                    device.chunks, m_model.groups,
                    device.arrays, reinterpret_cast<const std::byte*>(device.mlps),
                    nullptr,       m_host.embedding != nullptr ? device.embedding : nullptr,
                    nullptr};
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // the copies' sources go out of scope
    m_exact_loaded = true;
}

void DeviceScene::useAppearance(int32_t appearance, const CudaStream& stream)
{
    if (m_weights_ready && m_appearance == appearance)
        return;
    m_weights_ready = false; // until all of them are copied
    const DecodeWeights weights = packFragments(m_host, appearance);
    copyIn(m_fragments, weights.fragments.data(), weights.fragments.size(), stream);
    copyIn(m_biases, weights.biases.data(), weights.biases.size(), stream);
    copyIn(m_bank, weights.bank.data(), weights.bank.size(), stream);
    ExactWeights exact;
    if (m_weights != nullptr)
        exact = packExact(m_host, appearance);
    copyIn(m_weights, &exact, m_weights != nullptr ? 1 : 0, stream);
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // the copies' sources go out of scope
    m_appearance = appearance;
    m_weights_ready = true;
}

} // namespace gsc
