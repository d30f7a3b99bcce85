// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device_scene.h"

#include "kernels/decode/decode_fragments.h"
#include "kernels/math/lod.h"
#include "kernels/math/mlp.h"
#include "kernels/upload/upload_cuda.h"

#include <algorithm>
#include <vector>

namespace gsc {

namespace {

// Host pointers of a chunk's arrays, in the order of ChunkArray; null where absent or of no use to a frame.
struct ArrayPointers {
    const void* of[uint32_t(ChunkArray::Count)];
};

ArrayPointers arrayPointers(const ChunkArrays& arrays)
{
    const void* position = arrays.grid_position;
    if (position == nullptr)
        position = arrays.float_position;
    return {{position, arrays.source_index, arrays.extra_level, arrays.scale, arrays.offset, arrays.feature,
             arrays.rotation, nullptr, nullptr}};
}

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
    float *lod_shift, *placement, *size, *shape, *rotation, *biases, *bank;
    uint32_t *level_first, *source;
    uint16_t *feature, *fragments;
    uint64_t* offset;
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
    a.placement = layout.take<float>(anchors * 4);
    a.size = layout.take<float>(anchors * 3);
    a.shape = layout.take<float>(anchors * 6);
    a.source = layout.take<uint32_t>(anchors);
    if (params.flags & kModelHasRotation)
        a.rotation = layout.take<float>(anchors * 4);
    if (m_fast_possible) {
        a.feature = layout.take<uint16_t>(anchors * params.feat_dim);
        a.offset = layout.take<uint64_t>(anchors * params.n_offsets);
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
    m_model = {params,           arrays.levels,         arrays.groups,    arrays.runs,
               arrays.lod_shift, arrays.level_first,    arrays.placement, arrays.size,
               arrays.shape,     arrays.rotation,       arrays.feature,   arrays.offset,
               arrays.source,    uint32_t(runs.size()), uint32_t(anchors)};
    m_fragments = arrays.fragments;
    m_biases = arrays.biases;
    m_bank = arrays.bank;
    m_weights = arrays.weights;
    uploadChunks(arrays, stream);
}

void DeviceScene::copyArrays(uint64_t chunk, const ChunkArrayLayout& layout, unsigned char* to,
                             const CudaStream& stream) const
{
    const ArrayPointers from = arrayPointers(m_host.arrays[chunk]);
    for (uint32_t a = 0; a < uint32_t(ChunkArray::Count); ++a)
        if (layout.stride[a] != 0 && from.of[a] != nullptr)
            GSC_CUDA_CHECK(cudaMemcpyAsync(to + layout.offset[a], from.of[a],
                                           layout.stride[a] * m_host.chunks[chunk].anchor_count, cudaMemcpyHostToDevice,
                                           stream.handle));
}

void DeviceScene::uploadChunks(const FlatArrays& arrays, const CudaStream& stream)
{
    const ModelParams& params = m_model.params;
    size_t largest = 0;
    for (uint64_t c = 0; c < params.chunk_count; ++c)
        largest = std::max<size_t>(largest, chunkArrayLayout(params, m_host.chunks[c].anchor_count).bytes);
    m_staging.reserve(std::max<size_t>(largest, 1), "a chunk on its way");
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        UploadArgs args{};
        args.chunk = m_host.chunks[c];
        args.level = m_host.levels[args.chunk.level_index];
        args.layout = chunkArrayLayout(params, args.chunk.anchor_count);
        copyArrays(c, args.layout, m_staging.get(), stream);
        args.payload = m_staging.get();
        args.feat_dim = params.feat_dim;
        args.n_offsets = params.n_offsets;
        args.grid_positions = params.position_encoding == uint32_t(PositionEncoding::Grid);
        args.placement = arrays.placement;
        args.size = arrays.size;
        args.shape = arrays.shape;
        args.rotation = arrays.rotation;
        args.feature = arrays.feature;
        args.offset = arrays.offset;
        args.source = arrays.source;
        uploadCuda(args, stream.handle);
    }
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle));
    m_staging.release();
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
        const ChunkArrayLayout chunk = chunkArrayLayout(params, m_host.chunks[c].anchor_count);
        copyArrays(c, chunk, to, stream);
        const auto point = [&](ChunkArray array, const auto*& pointer) {
            const auto a = uint32_t(array);
            if (chunk.stride[a] != 0)
                pointer = reinterpret_cast<std::remove_reference_t<decltype(pointer)>>(to + chunk.offset[a]);
        };
        if (params.position_encoding == uint32_t(PositionEncoding::Grid))
            point(ChunkArray::Position, arrays[c].grid_position);
        else
            point(ChunkArray::Position, arrays[c].float_position);
        point(ChunkArray::SourceIndex, arrays[c].source_index);
        point(ChunkArray::ExtraLevel, arrays[c].extra_level);
        point(ChunkArray::Scale, arrays[c].scale);
        point(ChunkArray::Offset, arrays[c].offset);
        point(ChunkArray::Feature, arrays[c].feature);
        point(ChunkArray::Rotation, arrays[c].rotation);
        to += alignUp(chunk.bytes, kPayloadAlign);
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
