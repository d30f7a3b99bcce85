// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device/device_scene.h"

#include "kernels/decode/fast/decode_fast_cuda.h"
#include "kernels/decode/fast/fragments.h"
#include "kernels/math/anchor.h"
#include "kernels/math/eye.h"
#include "kernels/math/lod.h"
#include "kernels/math/mlp.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

namespace gsc {

namespace {

// Bytes of the section MLPW from the start to the end of its last array.
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

uint32_t runsOf(const ChunkRecord& chunk)
{
    return (chunk.group_count + kRunGroups - 1) / kRunGroups;
}

// Returns the group runs of the chunks: up to 32 groups, one for each lane of a warp.
std::vector<GroupRun> groupRuns(const ModelView& model, const std::vector<uint32_t>& chunks)
{
    std::vector<GroupRun> runs;
    for (const uint32_t c : chunks) {
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

std::vector<uint32_t> inFileOrder(const ModelView& model)
{
    std::vector<uint32_t> chunks(model.params->chunk_count);
    std::iota(chunks.begin(), chunks.end(), 0u);
    return chunks;
}

// Returns the numbers of the chunks in the order in which an eye needs them.
std::vector<uint32_t> inViewOrder(const ModelView& model, const EyeParams& eye)
{
    struct Rank {
        bool behind;
        int32_t level;
        float distance;
        uint32_t chunk;
    };
    std::vector<Rank> ranks;
    for (uint32_t c = 0; c < model.params->chunk_count; ++c) {
        const ChunkRecord& chunk = model.chunks[c];
        float depth = eye.world_to_view[11]; // view z of the farthest point of the chunk's box
        float distance = 0;                  // squared distance to the nearest point of the chunk's box
        for (int i = 0; i < 3; ++i) {
            const float z = eye.world_to_view[8 + i], centre = eye.center[i];
            depth += std::max(z * chunk.gaussian_min[i], z * chunk.gaussian_max[i]);
            const float apart = std::max({chunk.gaussian_min[i] - centre, centre - chunk.gaussian_max[i], 0.0f});
            distance += apart * apart;
        }
        ranks.push_back({depth < 0, model.levels[chunk.level_index].level, distance, c});
    }
    std::ranges::sort(ranks, [](const Rank& a, const Rank& b) {
        return std::tie(a.behind, a.level, a.distance, a.chunk) < std::tie(b.behind, b.level, b.distance, b.chunk);
    });
    std::vector<uint32_t> chunks;
    for (const Rank& rank : ranks)
        chunks.push_back(rank.chunk);
    return chunks;
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
    const bool compact = m_fast_possible && (params.flags & kModelCompact) != 0;
    if (compact) {
        a.anchors.compact_shape = layout.take<CompactShape>(anchors);
        a.anchors.compact_feature = layout.take<uint32_t>(anchors * params.feat_dim / 4);
        a.anchors.compact_offset = layout.take<uint32_t>(anchors * params.n_offsets);
    } else {
        a.anchors.shape = layout.take<float>(anchors * 6);
    }
    a.anchors.source = layout.take<uint32_t>(anchors);
    if (params.flags & kModelHasRotation)
        a.anchors.rotation = layout.take<float>(anchors * 4);
    if (m_fast_possible) {
        if (!compact) {
            a.anchors.feature = layout.take<uint16_t>(anchors * params.feat_dim);
            a.anchors.offset = layout.take<uint64_t>(anchors * params.n_offsets);
        }
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
    loadFrame(model, stream);
    beginReading(inFileOrder(model));
    m_reader->all([&](const ChunkPiece& piece) -> const CudaStream& { return upload(piece); });
    waitForUploads();
    endReading();
}

void DeviceScene::loadFrame(const ModelView& model, const CudaStream& stream)
{
    m_reader.reset(); // stops reading the model that was loaded before
    m_anchors_there = 0;
    m_runs_there = 0;
    m_host = model;
    m_model = {}; // if the code below throws, no pointer into freed memory is left
    const ModelParams& params = *model.params;
    m_anchors = 0;
    std::vector<uint32_t> level_first(params.level_count, UINT32_MAX);
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        const ChunkRecord& chunk = model.chunks[c];
        m_anchors += chunk.anchor_count;
        level_first[chunk.level_index] = std::min(level_first[chunk.level_index], chunk.anchor_first);
    }
    checkNumbers(0);
    m_fast_possible = canDecodeFast(model);
    m_exact_loaded = m_weights_ready = false;
    m_exact.release();
    m_origins.release();
    m_inputs = 0;
    for (const MlpKind kind : {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color, MlpKind::FeatureBank})
        if (const MlpRecord* mlp = mlpRecord(model, kind))
            m_inputs |= mlp->inputs;

    uint32_t runs = 0;
    for (uint64_t c = 0; c < params.chunk_count; ++c)
        runs += runsOf(model.chunks[c]);
    const FlatArrays arrays =
        layOutIn(m_flat, "the model", [&](ArenaLayout& layout) { return layOutFlat(layout, m_anchors, runs); });
    std::vector<float> shift(params.level_count);
    for (uint32_t l = 0; l < params.level_count; ++l)
        shift[l] = lodShift<float>(params, model.levels[l].level);
    copyIn(arrays.levels, model.levels, params.level_count, stream);
    copyIn(arrays.groups, model.groups, params.group_count, stream);
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
               of_anchors.compact_shape,
               of_anchors.compact_feature,
               of_anchors.compact_offset,
               runs,
               uint32_t(m_anchors)};
    m_fragments = arrays.fragments;
    m_biases = arrays.biases;
    m_bank = arrays.bank;
    m_weights = arrays.weights;
    m_to = of_anchors;
    m_runs = arrays.runs;
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // waits for the copies, whose sources go out of scope
}

void DeviceScene::bring(const EyeParams& eye, ChunkReader::Clock::time_point end, ChunkReader::Clock::duration patience)
{
    if (m_reader == nullptr)
        beginReading(inViewOrder(m_host, eye));
    const bool whole =
        m_reader->some(end, patience, [&](const ChunkPiece& piece) -> const CudaStream& { return upload(piece); });
    waitForUploads(); // waits, because a frame will read the arrays that the uploads write
    if (whole)
        endReading();
}

void DeviceScene::beginReading(const std::vector<uint32_t>& chunks)
{
    const std::vector<GroupRun> runs = groupRuns(m_host, chunks);
    copyIn(m_runs, runs.data(), runs.size(), m_ways[0].stream);
    layOutIn(m_staging, "pieces of the model on their way", [&](ArenaLayout& layout) {
        for (Way& way : m_ways)
            way.piece = layout.take<unsigned char>(ChunkReader::pieceBytes(m_host));
        return 0;
    });
    m_reader = std::make_unique<ChunkReader>(m_host, chunks, m_threads);
    waitForUploads(); // waits for the copy, whose source goes out of scope
}

void DeviceScene::waitForUploads() const
{
    for (const Way& way : m_ways)
        GSC_CUDA_CHECK(cudaStreamSynchronize(way.stream.handle));
}

const CudaStream& DeviceScene::upload(const ChunkPiece& piece)
{
    checkNumbers(piece.last_source); // a model that was cut down has numbers larger than its count of anchors
    const ModelParams& params = m_model.params;
    const ChunkRecord& whole = m_host.chunks[piece.chunk];
    ChunkRecord chunk = whole;
    chunk.anchor_first += piece.first;
    chunk.anchor_count = piece.count;
    const Way& way = m_ways[m_way++ % std::size(m_ways)];
    copyIn(way.piece, piece.bytes, piece.layout.bytes, way.stream);
    uploadCuda({chunk, m_host.levels[chunk.level_index], piece.layout, way.piece, params.feat_dim, params.n_offsets,
                params.position_encoding == uint32_t(PositionEncoding::Grid), (params.flags & kModelMaskedSlots) != 0,
                m_to},
               way.stream.handle);
    if (piece.first + piece.count == whole.anchor_count) {
        m_anchors_there += whole.anchor_count;
        m_runs_there += runsOf(whole);
    }
    return way.stream;
}

void DeviceScene::endReading()
{
    m_reader.reset();
    m_staging.release();
}

void DeviceScene::checkNumbers(uint32_t last_source) const
{
    const ModelParams& params = *m_host.params;
    if (m_anchors >= 1ull << kAnchorBits || (uint64_t(last_source) + 1) * params.n_offsets >= 1ull << 32)
        throw Error(ErrorCode::Unsupported, "cuda",
                    formatString("model has %llu anchors numbered to %u, of %u Gaussians each",
                                 static_cast<unsigned long long>(m_anchors), last_source, params.n_offsets),
                    "fewer than 2^30 anchors and 2^32 Gaussians", "draw on the CPU")
            .with({Setting::CpuBackend});
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
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // waits for the copy, whose source goes out of scope
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
    std::vector<unsigned char*> payloads(params.chunk_count);
    unsigned char* to = device.payloads;
    for (uint64_t c = 0; c < params.chunk_count; ++c) {
        const uint32_t count = m_host.chunks[c].anchor_count;
        payloads[c] = to;
        arrays[c] = chunkArrays(params, count, reinterpret_cast<const std::byte*>(to));
        to += alignUp(chunkArrayLayout(params, count).bytes, kPayloadAlign);
    }
    ChunkReader reader(m_host, inFileOrder(m_host), m_threads);
    reader.all([&](const ChunkPiece& piece) -> const CudaStream& {
        const ChunkArrayLayout whole = chunkArrayLayout(params, m_host.chunks[piece.chunk].anchor_count);
        // a stride of 0: the array is absent, or frames do not need it
        for (size_t a = 0; a < std::size(whole.stride); ++a)
            copyIn(payloads[piece.chunk] + whole.offset[a] + whole.stride[a] * piece.first,
                   piece.bytes + piece.layout.offset[a], piece.layout.stride[a] * piece.count, stream);
        return stream;
    });
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
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // waits for the copies, whose sources go out of scope
    m_exact_loaded = true;
}

void DeviceScene::useAppearance(int32_t appearance, const CudaStream& stream)
{
    if (m_weights_ready && m_appearance == appearance)
        return;
    m_weights_ready = false; // false until all weights are copied
    const DecodeWeights weights = packFragments(m_host, appearance);
    copyIn(m_fragments, weights.fragments.data(), weights.fragments.size(), stream);
    copyIn(m_biases, weights.biases.data(), weights.biases.size(), stream);
    copyIn(m_bank, weights.bank.data(), weights.bank.size(), stream);
    ExactWeights exact;
    if (m_weights != nullptr)
        exact = packExact(m_host, appearance);
    copyIn(m_weights, &exact, m_weights != nullptr ? 1 : 0, stream);
    GSC_CUDA_CHECK(cudaStreamSynchronize(stream.handle)); // waits for the copies, whose sources go out of scope
    m_appearance = appearance;
    m_weights_ready = true;
}

} // namespace gsc
