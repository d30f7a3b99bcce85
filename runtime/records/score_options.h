// SPDX-License-Identifier: Apache-2.0
// Frames of a run that are scored against the exact images.
#pragma once

#include <cstdint>

namespace gsc {

// Every `every`-th frame is scored, from `first` on. Changes from frame to frame are known where `every` is 1.
struct ScoreOptions {
    uint32_t ssim_every = 0, flip_every = 0; // scored frames: 1 = each, 0 = none
    uint64_t every = 1, first = 0;

    [[nodiscard]] bool scores(uint64_t frame) const { return frame >= first && (frame - first) % every == 0; }
    [[nodiscard]] uint64_t scoredOf(uint64_t frames) const // of so many
    {
        return frames > first ? (frames - first - 1) / every + 1 : 0;
    }
};

} // namespace gsc
