// SPDX-License-Identifier: Apache-2.0
// Tiled decoder of tier `exact`. A warp takes 16 anchors at a time. A lane has the sums of 4 anchors for 12 or 16 units
// in registers, and reads inputs and weights from shared memory four at a time. Each sum starts at zero and takes its
// inputs in the trainers' order: features first, the bias last, with the appearance. So what the features add is equal
// for both eyes and is summed once.
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ptx.cuh"
#include "kernels/decode/exact/exact_splat.cuh"

#include <algorithm>

namespace gsc {

namespace {

constexpr uint32_t kMostWarps = 12; // warps of a block, one block per multiprocessor: with more, registers spill
constexpr uint32_t kRows = 16;      // anchors that a warp takes at a time
constexpr uint32_t kHeadValues = 33 * kRows;      // from head to head: two of them meet in a memory bank, not three
constexpr uint32_t kOutputs = 11 * kExactOffsets; // rows of outputs: opacity, covariance (k-major), colour (k-major)
constexpr uint32_t kViewRows = 5;                 // rows of inputs for the view: direction, distance, level
constexpr uint32_t kUnitTile = 12, kOutputTile = 16;
static_assert(kUnitTile * 8 == kExactUnits && kOutputTile * 8 == kExactColumns);

// Shared memory of one warp. A row has a value for each of 16 anchors.
struct Room {
    float4 partial[kUnitTile][32]; // sums of each lane over the features, four anchors together
    union {                        // only one member is in use at a time
        float inputs[kFastFeatures][kRows];
        float hidden[3 * kHeadValues];
        float outputs[kOutputs][kRows];
    };
    float view[kViewRows][kRows];
    const float* features[kRows]; // pointers into the model's features
    const float* offsets[kRows];
    const float* scales[kRows];
    uint32_t anchors[kRows];
    uint16_t alive[kOutputs / 11 * kRows]; // row | k << 8 of each Gaussian that one eye may see
};

// Number of warps of a block, whose shared memory holds the weights and a Room for each warp.
uint32_t warpsOf(size_t shared_bytes)
{
    const size_t rooms = shared_bytes - std::min(shared_bytes, sizeof(ExactWeights));
    return uint32_t(std::min<size_t>(rooms / sizeof(Room), kMostWarps));
}

size_t sharedBytes(uint32_t warps)
{
    return sizeof(ExactWeights) + warps * sizeof(Room);
}

__device__ __forceinline__ float4 fourAt(const float* p)
{
    return *reinterpret_cast<const float4*>(p);
}

// Computes sums[i][first + j] += a[i] * w[j] for four anchors i and kUnits units j.
template <uint32_t kUnits>
__device__ __forceinline__ void multiplyAdd(const float4& a, const float4& w, uint32_t first, float (&sums)[4][kUnits])
{
    const float as[4] = {a.x, a.y, a.z, a.w}, ws[4] = {w.x, w.y, w.z, w.w};
#pragma unroll
    for (uint32_t i = 0; i < 4; ++i)
#pragma unroll
        for (uint32_t j = 0; j < 4; ++j)
            sums[i][first + j] = fmaf(as[i], ws[j], sums[i][first + j]);
}

// Loads the features of the anchors in `rows` (a bit each) as rows of inputs.
__device__ __forceinline__ void gatherFeatures(Room& room, uint32_t rows, uint32_t lane)
{
    constexpr uint32_t kParts = kFastFeatures / 4; // parts of 4 features into which an anchor's are divided
#pragma unroll
    for (uint32_t i = 0; i < kRows * kParts / 32; ++i) {
        const uint32_t row = (i * 32 + lane) / kParts, part = lane % kParts;
        const float4 f = (rows >> row & 1u) != 0 ? fourAt(room.features[row] + 4 * part) : float4{0, 0, 0, 0};
        room.inputs[4 * part][row] = f.x;
        room.inputs[4 * part + 1][row] = f.y;
        room.inputs[4 * part + 2][row] = f.z;
        room.inputs[4 * part + 3][row] = f.w;
    }
    __syncwarp();
}

// Passes the features through the feature bank, as bankFeature() does: strided copies, weighted by a network.
__device__ __forceinline__ void applyBank(const float* bank, Room& room, uint32_t lane)
{
    const uint32_t row = lane % kRows, first = lane / kRows * (kFastFeatures / 2);
    float w[3] = {0.0f, 0.0f, 0.0f};
    for (uint32_t u = 0; u < kBankUnits; ++u) {
        const float* unit = bank + u * kBankStride;
        float h = 0.0f;
#pragma unroll
        for (uint32_t i = 0; i < kViewRows; ++i)
            h = fmaf(unit[i], room.view[i][row], h);
        h += unit[kViewRows];
        h = h < 0.0f ? 0.0f : h; // a ReLU that keeps NaN
#pragma unroll
        for (uint32_t i = 0; i < 3; ++i)
            w[i] = fmaf(unit[kViewRows + 1 + i], h, w[i]);
    }
#pragma unroll
    for (uint32_t i = 0; i < 3; ++i)
        w[i] += bank[kBankUnits * kBankStride + i];
    softmax3(w);
    float banked[kFastFeatures / 2];
#pragma unroll
    for (uint32_t i = 0; i < kFastFeatures / 2; ++i) {
        const uint32_t j = first + i;
        banked[i] = room.inputs[4 * (j % (kFastFeatures / 4))][row] * w[0] +
                    room.inputs[2 * (j % (kFastFeatures / 2))][row] * w[1] + room.inputs[j][row] * w[2];
    }
    __syncwarp();
#pragma unroll
    for (uint32_t i = 0; i < kFastFeatures / 2; ++i)
        room.inputs[first + i][row] = banked[i];
    __syncwarp();
}

// Sums the part of the features for the hidden units of all heads: units 32 j + 4 column + c of a lane's four anchors.
__device__ __forceinline__ void sumFeatures(const ExactWeights& weights, Room& room, uint32_t lane)
{
    const uint32_t four = 4 * (lane & 3u), column = lane >> 2;
    float sums[4][kUnitTile] = {};
#pragma unroll 4
    for (uint32_t k = 0; k < kFastFeatures; ++k) {
        const float4 a = fourAt(&room.inputs[k][four]);
#pragma unroll
        for (uint32_t j = 0; j < kUnitTile / 4; ++j)
            multiplyAdd(a, fourAt(&weights.first[k][32 * j + 4 * column]), 4 * j, sums);
    }
#pragma unroll
    for (uint32_t u = 0; u < kUnitTile; ++u)
        room.partial[u][lane] = {sums[0][u], sums[1][u], sums[2][u], sums[3][u]};
    __syncwarp(); // waits before the inputs are overwritten
}

// Computes the hidden units, with the first `rows` inputs of the view.
__device__ __forceinline__ void hiddenUnits(const ExactWeights& weights, uint32_t rows, Room& room, uint32_t lane)
{
    const uint32_t four = 4 * (lane & 3u), column = lane >> 2;
    float sums[4][kUnitTile];
#pragma unroll
    for (uint32_t u = 0; u < kUnitTile; ++u) {
        const float4 p = room.partial[u][lane];
        sums[0][u] = p.x;
        sums[1][u] = p.y;
        sums[2][u] = p.z;
        sums[3][u] = p.w;
    }
    for (uint32_t k = 0; k < rows; ++k) {
        const float4 a = fourAt(&room.view[k][four]);
#pragma unroll
        for (uint32_t j = 0; j < kUnitTile / 4; ++j)
            multiplyAdd(a, fourAt(&weights.first[kFastFeatures + k][32 * j + 4 * column]), 4 * j, sums);
    }
#pragma unroll
    for (uint32_t u = 0; u < kUnitTile; ++u) {
        const uint32_t head = u / 4, unit = 4 * column + u % 4;
        const float bias = weights.first_bias[32 * head + unit];
        float h[4];
#pragma unroll
        for (uint32_t i = 0; i < 4; ++i) {
            h[i] = sums[i][u] + bias;
            h[i] = h[i] < 0.0f ? 0.0f : h[i]; // a ReLU that keeps NaN
        }
        *reinterpret_cast<float4*>(&room.hidden[head * kHeadValues + unit * kRows + four]) = {h[0], h[1], h[2], h[3]};
    }
    __syncwarp();
}

// Computes the second layers, as rows of outputs before their activations. K: Gaussians per anchor.
__device__ __forceinline__ void secondLayers(const ExactWeights& weights, uint32_t K, Room& room, uint32_t lane)
{
    const uint32_t four = 4 * (lane & 3u), column = lane >> 2;
    const uint32_t head = column == 0 ? 0u : column < 6 ? 1u : 2u;
    const float* const hidden = room.hidden + head * kHeadValues + four;
    float sums[4][kOutputTile] = {};
#pragma unroll 4
    for (uint32_t k = 0; k < kExactHidden; ++k) {
        const float4 a = fourAt(hidden + k * kRows);
#pragma unroll
        for (uint32_t j = 0; j < kOutputTile / 4; ++j)
            multiplyAdd(a, fourAt(&weights.second[k][exactColumn(column, 4 * j)]), 4 * j, sums);
    }
    __syncwarp(); // waits before the hidden units are overwritten
    const uint32_t first = kOutputTile * (column - (head == 0 ? 0u : head == 1 ? 1u : 6u));
    const uint32_t count = head == 0 ? K : head == 1 ? 7 * K : 3 * K;
    const uint32_t base = head == 0 ? 0u : head == 1 ? K : 8 * K;
#pragma unroll
    for (uint32_t t = 0; t < kOutputTile; ++t) {
        const float bias = weights.second_bias[exactColumn(column, t)];
        if (first + t < count)
            *reinterpret_cast<float4*>(&room.outputs[base + first + t][four]) = {sums[0][t] + bias, sums[1][t] + bias,
                                                                                 sums[2][t] + bias, sums[3][t] + bias};
    }
    __syncwarp();
}

// Activates the opacities, lists the Gaussians that an eye may see, and returns their number. positive: is any above 0?
__device__ __forceinline__ uint32_t listAlive(const DecodeExactArgs& args, uint32_t e, uint32_t first, uint32_t rows,
                                              Room& room, uint32_t lane, bool& positive)
{
    const uint32_t K = args.model.params.n_offsets, row = lane % kRows;
    const bool present = (rows >> row & 1u) != 0;
    const float fraction = args.fraction != nullptr && present ? args.fraction[2 * (first + row) + e] : 1.0f;
    const bool masks = (args.model.params.flags & kModelMaskedSlots) != 0;
    uint32_t total = 0;
    for (uint32_t k = lane / kRows; k < (K + 1) / 2 * 2; k += 2) { // even rounds, so that whole warps stay together
        bool alive = false;
        if (present && k < K) {
            const float opacity = tanhf(room.outputs[k][row]) * fraction;
            positive |= opacity > 0.0f;
            alive = opacity >= kOpacityFloor && !isMaskedSlot(masks, room.offsets[row] + 3 * k);
            room.outputs[k][row] = opacity;
        }
        const uint32_t mask = __ballot_sync(~0u, alive);
        if (alive)
            room.alive[total + __popc(mask & ((1u << lane) - 1u))] = uint16_t(row | k << 8);
        total += __popc(mask);
    }
    __syncwarp();
    return total;
}

// Gaussian k of an anchor, made from the outputs of the networks.
__device__ __forceinline__ GaussianOf<float> gaussianAt(const DecodeExactArgs& args, const Room& room, uint32_t row,
                                                        uint32_t k)
{
    const uint32_t K = args.model.params.n_offsets, anchor = room.anchors[row];
    const float4 center = reinterpret_cast<const float4*>(args.model.placement)[anchor];
    const float anchor_at[3] = {center.x, center.y, center.z};
    const float* const offset = room.offsets[row] + 3 * k;
    const float* const reach = args.model.size + size_t(3) * anchor;
    GaussianOf<float> g;
#pragma unroll
    for (uint32_t i = 0; i < 3; ++i) {
        g.position[i] = anchor_at[i] + offset[i] * reach[i];
        const float extent =
            args.model.shape != nullptr ? args.model.shape[size_t(6) * anchor + 3 + i] : expf(room.scales[row][3 + i]);
        g.scale[i] = extent * sigmoid(room.outputs[K + 7 * k + i][row]);
        g.color[i] = sigmoid(room.outputs[8 * K + 3 * k + i][row]);
    }
#pragma unroll
    for (uint32_t i = 0; i < 4; ++i)
        g.rotation[i] = room.outputs[K + 7 * k + 3 + i][row];
    normalizeQuaternion(g.rotation);
    g.opacity = room.outputs[k][row];
    g.order = args.model.source[anchor] * K + k;
    return g;
}

// Projects the `count` listed Gaussians; writes and counts those that are visible.
__device__ __forceinline__ void emitAlive(const DecodeExactArgs& args, uint32_t e, uint32_t count, const Room& room,
                                          uint32_t lane, EyeTally& tally)
{
    const EyeParams& eye = args.eyes[e];
#pragma unroll 1
    for (uint32_t first = 0; first < count; first += 32) {
        SplatPlace place{0, kNoBins};
        ExactSplat splat;
        if (first + lane < count) {
            const uint32_t owner = room.alive[first + lane], row = owner & 255u;
            const GaussianOf<float> g = gaussianAt(args, room, row, owner >> 8);
            const Footprint<float> f = projectGaussian<float>(eye, args.rules, g);
            bool here = true;
            if (args.pass.count > 1) { // a Gaussian whose depth is not finite is counted in the pass of its anchor
                const float4 p = reinterpret_cast<const float4*>(args.model.placement)[room.anchors[row]];
                const float z = isFinite(f.depth) ? f.depth : viewPoint<float>(eye, {p.x, p.y, p.z}).z;
                here = passOf(args.pass, args.grid, z) == args.pass.index;
            }
            if (here) {
                ++tally.alive;
                if (!f.finite) // true for few Gaussians
                    atomicAdd(&args.counters->dropped[e], 1u);
                else if (f.visible)
                    place = {__float_as_uint(f.depth), binBox(args, e, f, g.opacity)};
                splat = exactSplat(f, g);
            }
        }
        const bool drawn = place.box != kNoBins;
        const uint32_t slot =
            tally.writer.reserve(drawn, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[e]);
        if (drawn && slot < args.slot_capacity) {
            ++tally.written;
            const size_t at = size_t(e) * args.slot_capacity + slot;
            args.splats[at] = splat;
            args.places[at] = place;
        } else if (drawn) {
            atomicOr(&args.counters->overflow, kSlotOverflow);
            place.box = kNoBins;
        }
        tally.pairs += countCells(args, e, place);
    }
}

// Computes a row's inputs that depend on the view, for an eye at eye_center.
__device__ __forceinline__ void lookFrom(const DecodeExactArgs& args, const float* eye_center, Room& room,
                                         uint32_t lane, float level)
{
    if (lane < kRows) {
        const float4 p = reinterpret_cast<const float4*>(args.model.placement)[room.anchors[lane]];
        const float v[3] = {p.x - eye_center[0], p.y - eye_center[1], p.z - eye_center[2]};
        const float distance = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (uint32_t i = 0; i < 3; ++i)
            // note: NaN if the eye is at the anchor itself, whose Gaussians are then dropped (format facts, trap 17)
            room.view[i][lane] = v[i] / distance;
        room.view[3][lane] = distance;
        room.view[4][lane] = level;
    }
    __syncwarp();
}

__global__ void __launch_bounds__(kMostWarps * 32, 1) decodeExactKernel(const __grid_constant__ DecodeExactArgs args)
{
    GSC_DYNAMIC_SHARED(memory);
    const ExactWeights& weights = *reinterpret_cast<const ExactWeights*>(memory);
    for (uint32_t i = threadIdx.x; i < sizeof(ExactWeights) / sizeof(float4); i += blockDim.x)
        reinterpret_cast<float4*>(memory)[i] = reinterpret_cast<const float4*>(args.weights)[i];
    __syncthreads();

    const uint32_t lane = threadIdx.x & 31u, warps = blockDim.x / 32;
    Room& room = reinterpret_cast<Room*>(memory + sizeof(ExactWeights))[threadIdx.x >> 5];
    const uint32_t count = min(*args.visible_count, args.visible_capacity);
    const uint32_t view_rows = args.takes_level ? 5u : args.takes_distance ? 4u : 3u;
    EyeTally left, right;
    bool positive_left = false, positive_right = false;

    for (uint32_t first = (blockIdx.x * warps + (threadIdx.x >> 5)) * kRows; first < count;
         first += gridDim.x * warps * kRows) {
        uint32_t seen_by = 0;
        float level = 0.0f;
        if (lane < kRows && first + lane < count) {
            const uint32_t entry = args.visible[first + lane], anchor = entry & ((1u << kAnchorBits) - 1u);
            seen_by = entry >> kAnchorBits;
            const uint32_t chunk = chunkOf(args.view, anchor), local = anchor - args.view.chunks[chunk].anchor_first;
            level = float(anchorLevel(args.view, chunk));
            room.anchors[lane] = anchor;
            room.features[lane] = args.view.arrays[chunk].feature + size_t(kFastFeatures) * local;
            room.scales[lane] = args.view.arrays[chunk].scale + size_t(6) * local;
            room.offsets[lane] = args.view.arrays[chunk].offset + size_t(3) * args.model.params.n_offsets * local;
        } else if (lane < kRows) {
            room.anchors[lane] = 0;
        }
        const uint32_t rows[kMaxEyes] = {__ballot_sync(~0u, (seen_by & 1u) != 0),
                                         __ballot_sync(~0u, (seen_by & 2u) != 0)};
        const uint32_t any = rows[0] | rows[1];
        __syncwarp();
        bool summed = false; // true once the features are summed, which with a feature bank must be done for each eye
#pragma unroll 1
        for (uint32_t e = 0; e < args.eye_count; ++e) {
            const uint32_t mine = e == 0 ? rows[0] : rows[1];
            if (mine == 0)
                continue;
            lookFrom(args, args.merged ? args.look_from : args.eyes[e].center, room, lane, level);
            if (!summed) {
                gatherFeatures(room, any, lane);
                if (args.bank != nullptr)
                    applyBank(args.bank, room, lane);
                sumFeatures(weights, room, lane);
                summed = args.bank == nullptr;
            }
            hiddenUnits(weights, view_rows, room, lane);
            secondLayers(weights, args.model.params.n_offsets, room, lane);
            bool positive = false;
            const uint32_t alive = listAlive(args, e, first, mine, room, lane, positive);
            EyeTally tally = e == 0 ? left : right;
            emitAlive(args, e, alive, room, lane, tally);
            if (e == 0) {
                left = tally;
                positive_left |= positive;
            } else {
                right = tally;
                positive_right |= positive;
            }
            __syncwarp(); // waits before memory that other lanes read is written again
        }
    }
    const uint32_t positive = (positive_left ? 1u : 0u) | (positive_right ? 2u : 0u);
    finish<false>(args, 0, left, positive, lane);
    if (args.eye_count > 1)
        finish<false>(args, 1, right, positive, lane);
}

} // namespace

uint32_t decodeExactGaps(bool tiled, uint32_t processors, size_t shared_bytes, uint32_t slot_capacity)
{
    return tiled ? processors * warpsOf(shared_bytes) * slotPiece(slot_capacity) : 0u;
}

void decodeExactCuda(const DecodeExactArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream)
{
    if (args.weights == nullptr)
        return decodeExactAnyCuda(args, processors, stream);
    const uint32_t warps = warpsOf(shared_bytes);
    launchCuda(decodeExactKernel, processors, warps * 32, sharedBytes(warps), stream, args);
}

} // namespace gsc
