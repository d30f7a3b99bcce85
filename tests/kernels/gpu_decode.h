// SPDX-License-Identifier: Apache-2.0
// Both decoders of the device on a list of anchors, and what the scalar reference makes of the same list.
#pragma once

#include "kernels/decode/decode_body.h"
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/decode/fast/decode_fast_cuda.h"
#include "tests/kernels/gpu_stage.h"

#include <map>

namespace gsc::test {

struct DecodeJob {
    const ModelView* view;
    StageModel* model;
    std::vector<EyeParams> eyes;
    std::vector<uint32_t> visible; // anchor | eyes << kAnchorBits
    std::vector<float> fraction;   // two per entry, or none
    int32_t appearance = -1;
    BinGrid grid{};
    std::vector<uint16_t> slab_of;
    uint32_t pass = 0, passes = 1;
    uint32_t slot_capacity = 16384;
    size_t shared_bytes = 0; // most bytes of a block in `fast`; 0: the device's limit
};

// `count` anchors in an order of their own, each seen by one eye or both.
DecodeJob decodeJob(const ModelView& view, StageModel& model, const std::vector<EyeParams>& eyes, uint32_t count);
void cutIntoPasses(DecodeJob& job, uint32_t passes);

template <typename Splat>
struct Emitted {
    Splat splat;
    SplatPlace place;
    uint32_t touch; // touchCode(), of a PackedSplat
};

template <typename Splat>
bool sameSplat(const Emitted<Splat>& a, const Emitted<Splat>& b)
{
    return std::memcmp(&a.splat, &b.splat, sizeof(Splat)) == 0 && a.place.box == b.place.box &&
           a.place.depth_bits == b.place.depth_bits;
}

// By eye and emission order.
template <typename Splat>
struct Decoded {
    std::map<uint64_t, Emitted<Splat>> eyes[kMaxEyes];
    FrameCounters counters;
};

// Launches and checks what holds for any input: guards, counts, the gaps marked, the cells the sums of the places.
// PackedSplat: the matrix units; ExactSplat: fp32, in tiles or one thread per anchor and eye.
template <typename Splat>
Decoded<Splat> decodeOnDevice(const DecodeJob& job);

struct Reference {
    GaussianOf<float> gaussian;
    Footprint<float> footprint;
};

struct ReferenceEye {
    std::map<uint64_t, Reference> gaussians; // Gaussians of opacity >= 1/255, by emission order
    uint32_t dropped = 0;
    bool any_positive = false;
};

ReferenceEye decodeOnHost(const DecodeJob& job, uint32_t eye);

struct DecodeTolerance {
    double pixel;      // error of the centre
    double covariance; // error of any entry, relative to the trace
    double color, opacity;
    double depth; // relative
};

// Weights, features and hidden values are halves in the matrix units: 2^-11 of their size each. The covariance suffers
// most, where the four raw values of a rotation are all small. Twice the worst of all cases below (7.7e-3, 8.6e-4,
// 2.0e-3). Positions are whole steps of 2^-20 of the largest offset.
constexpr DecodeTolerance kFast{3e-4, 1.6e-2, 1.8e-3, 4e-3, 1e-6};

// One splat for every Gaussian that safely is one, none but for those that may be, and each close to the reference.
template <typename Splat>
void checkSplats(const DecodeJob& job, const Decoded<Splat>& decoded, const DecodeTolerance& tolerance);

} // namespace gsc::test
