// SPDX-License-Identifier: Apache-2.0
// Last step of decoding in the tier `fast`: turns the networks' outputs for the Gaussians of a warp into splats in
// slots, and counts these in their cells.
#pragma once

#include "kernels/cuda/anchor_shape.cuh"
#include "kernels/decode/slots.cuh"
#include "kernels/decode/fast/networks.cuh"
#include "kernels/decode/fast/project_fast.cuh"

namespace gsc {

constexpr uint32_t kRows = 16; // rows of the networks: each is an anchor seen from one place
constexpr uint32_t kNoSlot = ~0u;

// Smallest box of bins that holds both boxes. Precondition: neither is kNoBins.
__device__ __forceinline__ uint32_t boxAround(uint32_t a, uint32_t b)
{
    return (__vminu4(a, b) & 0xffffu) | (__vmaxu4(a, b) & 0xffff0000u);
}

// Returns true if the Gaussian is so thin that FastRules::box() may not bound it. The margin covers rounding.
__device__ __forceinline__ bool isNeedle(const Candidate& splat)
{
    const float b = __uint_as_float(splat.words[0].w), c = __uint_as_float(splat.words[1].x);
    return !(c * c > 2 * kTrustedDeterminant * (b * b + c * c));
}

// Writes a slot that an eye does not see: a splat a few pixels in size that no image contains.
__device__ __forceinline__ void writeUnseen(const DecodeCudaArgs& args, uint32_t e, uint32_t slot, uint32_t order)
{
    const uint32_t one = __float_as_uint(1.0f), far_off = __float_as_uint(kUnseenPlace);
    uint4* const to = reinterpret_cast<uint4*>(args.splats + size_t(e) * args.slot_capacity + slot);
    to[0] = {far_off, far_off, one, 0};
    to[1] = {one, 0, 0xffff0000u, order};
    args.touches[touchPlace(true, e, slot)] = uint16_t(kTouchUnknown);
}

// Writes a splat to its slot. Returns true if it is drawn and there was room for it.
template <bool kShared>
__device__ __forceinline__ bool writeSplat(const DecodeCudaArgs& args, uint32_t e, bool drawn, uint32_t slot,
                                           const Candidate& splat)
{
    if (!drawn)
        return false;
    if (slot >= args.slot_capacity) {
        atomicOr(&args.counters->overflow, kSlotOverflow);
        return false;
    }
    uint4* const to = reinterpret_cast<uint4*>(args.splats + size_t(e) * args.slot_capacity + slot);
    to[0] = splat.words[0];
    to[1] = splat.words[1];
    args.touches[touchPlace(kShared, e, kShared ? slot : e * args.slot_capacity + slot)] = uint16_t(splat.touch);
    return true;
}

constexpr uint32_t kNoOrder = ~0u; // larger than any order of emission

// A Gaussian before its networks, which is equal for every eye.
struct PlainGaussian {
    float position[3], extent[3];
    uint32_t order; // number in the order of emission; kNoOrder if the offset is not finite
    bool masked;    // true: the slot is never drawn and must not be given to emitGaussian()
};

template <bool kCompact>
__device__ __forceinline__ PlainGaussian plainGaussian(const DeviceModel& model, uint32_t anchor, uint32_t k)
{
    const float4 center = reinterpret_cast<const float4*>(model.placement)[anchor];
    const AnchorShape shape = anchorShape<kCompact>(model, anchor);
    const OffsetSteps offset = offsetSteps<kCompact>(model, anchor, k);
    // note: joined by bits and not by a branch, which would delay the load of the source index
    const uint32_t order = (model.source[anchor] * model.params.n_offsets + k) | (offset.finite ? 0u : kNoOrder);
    return {{fmaf(offset.along[0], shape.step[0], center.x), fmaf(offset.along[1], shape.step[1], center.y),
             fmaf(offset.along[2], shape.step[2], center.z)},
            {shape.extent[0], shape.extent[1], shape.extent[2]},
            order,
            offset.masked};
}

// Counts for one lane: Gaussians alive, splats written (each 0 or 1), and pairs of a cell and a splat.
struct Emitted {
    uint32_t alive, written, pairs;
};

// Outputs of the networks for a Gaussian, after activation. quaternion: of length sqrt(2), as projectFast() takes it.
struct ActiveGaussian {
    float sigma[3], color[3], quaternion[4];
};

// Activates the outputs of a Gaussian. of(i): output i of the networks before activation: scale (0 to 2), rotation (3
// to 6), colour (7 to 9).
template <typename Outputs>
__device__ __forceinline__ ActiveGaussian activeGaussian(const PlainGaussian& plain, const Outputs& of)
{
    ActiveGaussian active{{plain.extent[0] * sigmoidFast(of(0)), plain.extent[1] * sigmoidFast(of(1)),
                           plain.extent[2] * sigmoidFast(of(2))},
                          {sigmoidFast(of(7)), sigmoidFast(of(8)), sigmoidFast(of(9))},
                          {}};
    float norm = 0.0f;
#pragma unroll
    for (uint32_t c = 0; c < 4; ++c) {
        active.quaternion[c] = of(3 + c);
        norm = fmaf(active.quaternion[c], active.quaternion[c], norm);
    }
    const float inverse = rsqrtf(0.5f * fmaxf(norm, 1e-24f));
#pragma unroll
    for (float& c : active.quaternion)
        c *= inverse;
    return active;
}

// Projects the Gaussian of a lane for one eye, and writes what the eye sees of it; a lane whose opacity is below
// kOpacityFloor has no Gaussian. All lanes of the warp call it together. project(out, finite): as projectFast().
// kShared: the eyes share their bins. slot and box: in, those to which the first eye wrote the Gaussian, or kNoSlot and
// kNoBins; out, those of this eye. The last eye (`last`) gives each slot its place and counts it. A Gaussian takes one
// slot for each eye if a box round both would be larger than both together, or if blending could not tell that it ends
// within an eye's own box (isNeedle()). Two such slots may be in the same bin, but no eye sees both.
template <bool kShared, typename Project>
__device__ __forceinline__ Emitted emitProjected(const DecodeCudaArgs& args, uint32_t e, float opacity,
                                                 const float* position, const Project& project, bool last,
                                                 uint32_t& slot, uint32_t& box, uint32_t lane, SlotWriter& writer)
{
    Candidate out;
    Emitted emitted{};
    bool drawn = false;
    if (opacity >= kOpacityFloor) {
        const Vec3<float> at{position[0], position[1], position[2]};
        const bool here = args.pass.count == 1 ||
                          passOf(args.pass, args.grid, viewPoint<float>(args.eyes[e], at).z) == args.pass.index;
        if (here) {
            emitted.alive = 1;
            bool finite; // set to true if position and covariance are finite
            drawn = project(out, finite);
            drawn = drawn & finite;
            if (!finite) // true for few Gaussians
                atomicAdd(&args.counters->dropped[e], 1u);
        }
    }
    if constexpr (!kShared) {
        slot = writer.reserve(drawn, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[e]);
        const bool written = writeSplat<kShared>(args, e, drawn, slot, out);
        emitted.written = written ? 1u : 0u;
        if (written)
            args.places[size_t(e) * args.slot_capacity + slot] = out.place;
        else
            out.place.box = kNoBins;
        emitted.pairs = countCells(args, e, out.place);
    } else {
        if (drawn)
            out.place.box += args.grid.shift[e] * 0x00010001u;
        const bool again = box != kNoBins;
        const uint32_t around = again && drawn ? boxAround(box, out.place.box) : 0u;
        const bool wider = around != box || around != out.place.box;
        const bool apart =
            again && drawn && wider && (binCount(around) > binCount(box) + binCount(out.place.box) || isNeedle(out));
        const bool fresh = drawn && (slot == kNoSlot || apart);
        SplatPlace first_alone{0, kNoBins};
        if (again && (!drawn || apart)) {
            writeUnseen(args, e, slot, 0); // order 0, since a splat's order is read from the first eye's row
            first_alone = args.places[slot];
        }
        const uint32_t reserved =
            writer.reserve(fresh, lane, slotPiece(args.slot_capacity), &args.counters->pass.slots[0]);
        slot = fresh ? reserved : slot;
        const bool written = writeSplat<kShared>(args, e, drawn, slot, out);
        emitted.written = written ? 1u : 0u;
        if (written) {
            if (fresh && last)
                writeUnseen(args, 1 - e, slot, out.words[1].w);
            if (!fresh)
                out.place.box = around;
            if (fresh || around != box)
                args.places[slot] = out.place;
        } else {
            out.place.box = kNoBins;
        }
        slot = drawn ? slot : kNoSlot;
        box = out.place.box;
        if (last)
            // note: a loop that rarely has two rounds, so that this long code is compiled once
            for (bool more = true; more; out.place = first_alone, first_alone.box = kNoBins) {
                emitted.pairs += countCells(args, 0, out.place);
                more = __any_sync(~0u, first_alone.box != kNoBins);
            }
    }
    return emitted;
}

// Emits, as emitProjected() does, a Gaussian with the outputs of the networks. of: as in activeGaussian().
template <bool kShared, bool kThins, typename Outputs>
__device__ __forceinline__ Emitted emitGaussian(const DecodeCudaArgs& args, uint32_t e, float opacity,
                                                const PlainGaussian& plain, const Outputs& of, bool last,
                                                uint32_t& slot, uint32_t& box, uint32_t lane, SlotWriter& writer)
{
    const auto project = [&](Candidate& out, bool& finite) {
        const ActiveGaussian active = activeGaussian(plain, of);
        const bool drawn = projectFast<kThins>(args, e, plain.position, active.sigma, active.quaternion, opacity,
                                               active.color, plain.order, out, finite);
        finite = finite & (plain.order != kNoOrder) & isfinite(active.color[0] + active.color[1] + active.color[2]);
        return drawn;
    };
    return emitProjected<kShared>(args, e, opacity, plain.position, project, last, slot, box, lane, writer);
}

__device__ __forceinline__ void addTo(EyeTally& tally, const Emitted& emitted)
{
    tally.alive += emitted.alive;
    tally.written += emitted.written;
    tally.pairs += emitted.pairs;
}

} // namespace gsc
