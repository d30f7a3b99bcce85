// SPDX-License-Identifier: Apache-2.0
// Choice of a run's frames that are scored against the exact images.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace gsc {

// Scored frames: every `every`-th frame from `first` on, or the frames in `listed`. Changes from frame to frame are known only
// if consecutive frames are scored.
struct ScoredFrames {
    uint64_t first = 0, every = 1;
    std::vector<uint64_t> listed; // ascending; empty: `first` and `every` apply

    bool operator==(const ScoredFrames&) const = default;

    [[nodiscard]] bool inARow() const { return listed.empty() && every == 1; }
    [[nodiscard]] bool scores(uint64_t frame) const
    {
        return listed.empty() ? frame >= first && (frame - first) % every == 0
                              : std::ranges::binary_search(listed, frame);
    }
    [[nodiscard]] uint64_t scoredOf(uint64_t frames) const // number of scored frames among the first `frames`
    {
        if (!listed.empty())
            return uint64_t(std::ranges::lower_bound(listed, frames) - listed.begin());
        return frames > first ? (frames - first - 1) / every + 1 : 0;
    }
    // Index of a scored frame among the scored frames, and the frame of such an index.
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

// Scored frames, and those among them that also get an SSIM and a FLIP.
struct ScoreOptions : ScoredFrames {
    uint32_t ssim_every = 0, flip_every = 0; // every so many scored frames; 0 = none
};

} // namespace gsc
