// SPDX-License-Identifier: Apache-2.0
// Frames of a run that are scored against the exact images.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace gsc {

// Every `every`-th frame from `first` on, or those that `listed` names. Changes from frame to frame are known where all
// frames in a row are scored.
struct ScoredFrames {
    uint64_t first = 0, every = 1;
    std::vector<uint64_t> listed; // ascending; empty: `first` and `every` tell them

    bool operator==(const ScoredFrames&) const = default;

    [[nodiscard]] bool inARow() const { return listed.empty() && every == 1; }
    [[nodiscard]] bool scores(uint64_t frame) const
    {
        return listed.empty() ? frame >= first && (frame - first) % every == 0
                              : std::ranges::binary_search(listed, frame);
    }
    [[nodiscard]] uint64_t scoredOf(uint64_t frames) const // how many of so many
    {
        if (!listed.empty())
            return uint64_t(std::ranges::lower_bound(listed, frames) - listed.begin());
        return frames > first ? (frames - first - 1) / every + 1 : 0;
    }
    // Place of a scored frame among them, and back.
    [[nodiscard]] uint64_t placeOf(uint64_t frame) const
    {
        return listed.empty() ? (frame - first) / every
                              : uint64_t(std::ranges::lower_bound(listed, frame) - listed.begin());
    }
    [[nodiscard]] uint64_t frameOf(uint64_t place) const
    {
        return listed.empty() ? first + place * every : listed[place];
    }
};

struct ScoreOptions : ScoredFrames {
    uint32_t ssim_every = 0, flip_every = 0; // scored frames: 1 = each, 0 = none
};

} // namespace gsc
