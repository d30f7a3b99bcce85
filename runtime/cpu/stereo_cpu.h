// SPDX-License-Identifier: Apache-2.0
// One decode for both eyes (StereoMode::Merged) on the CPU.
#pragma once

#include "runtime/cpu/frame/decode_state.h"

namespace gsc {

// Decodes visible anchors [first, first + count) once, at the centre that args.eyes[0] has, whichever eye sees them;
// scratch.blocks[0] takes all their Gaussians, before any fading between levels.
void decodeForBothEyes(const DecodeArgs& args, size_t first, uint32_t count, DecodeScratch& scratch);

// Selects from `all`, the Gaussians of the `count` anchors at `visible`, those that one eye draws: Gaussians of the
// anchors it sees, faded for that eye. Returns `all` itself if it draws every one, otherwise `part`, whose arrays hold
// a block.
const GaussianBlock& gaussiansOfEye(const GaussianBlock& all, const VisibleAnchor* visible, uint32_t count,
                                    uint32_t eye, uint32_t n_offsets, GaussianBlock& part);

} // namespace gsc
