// SPDX-License-Identifier: Apache-2.0
// Decodes once for both eyes (StereoMode::Merged) on the CPU.
#pragma once

#include "runtime/cpu/frame/decode_state.h"

namespace gsc {

// Decodes visible anchors first to first + count - 1 once, as seen from the centre of args.eyes[0], whichever eye sees
// them. scratch.blocks[0] receives all their Gaussians, not yet faded between levels.
void decodeForBothEyes(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch);

// Selects the Gaussians that one eye draws from `all`, which holds those of the `count` anchors at `visible`: those of
// the anchors that the eye sees, faded for that eye. Returns `all` itself if the eye draws every one, otherwise
// `part`, whose arrays have room for a block.
const GaussianBlock& gaussiansOfEye(const GaussianBlock& all, const VisibleAnchor* visible, uint32_t count,
                                    uint32_t eye, uint32_t n_offsets, GaussianBlock& part);

} // namespace gsc
