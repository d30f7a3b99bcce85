// SPDX-License-Identifier: Apache-2.0
// The frames of a picture set that a shard draws, and those of them that it has drawn before it was stopped.
#pragma once

#include "player/options/play_options.h"
#include "player/shard/shard_rows.h"
#include "player/frames/shots.h"

#include <optional>
#include <string>
#include <vector>

namespace gsc {

class FrameShard {
public:
    // Reads --stats. Throws Error as ShardRows. Without --shard every frame is drawn and nothing is kept.
    explicit FrameShard(const PlayOptions& options);

    // `paths`: of the images of all frames, frame-major; none if they are not written.
    void plan(size_t frames, const std::vector<std::string>& paths, Reporter& log);

    [[nodiscard]] const std::vector<size_t>& frames() const { return m_frames; } // to draw
    [[nodiscard]] uint64_t own() const { return m_own; }                         // those and what is done
    // May its images be there already? A run that was killed leaves those of one frame without a line.
    [[nodiscard]] bool mayReplace(size_t frame) const;

    // Once it is known what draws. Throws Error(Usage) where --stats is of another set.
    void check(const std::vector<Shot>& shots, const std::string& backend, Tier tier);
    // Behind check(), in a folder that is there: makes --stats. Throws Error(Io).
    void begin();
    // Behind its images, so that a line stands for a whole frame.
    void add(size_t frame, const std::string& line);

private:
    [[nodiscard]] bool isDone(size_t frame, const std::vector<std::string>& paths) const;

    const PlayOptions& m_options;
    std::optional<ShardRows> m_rows; // none without --shard
    std::vector<size_t> m_frames;
    uint64_t m_own = 0;
    std::optional<size_t> m_cut; // the frame that a killed run was at
};

} // namespace gsc
