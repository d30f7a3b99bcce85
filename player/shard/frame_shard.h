// SPDX-License-Identifier: Apache-2.0
// Frames that a shard draws, without the frames that it had drawn before it was stopped.
#pragma once

#include "player/options/play_options.h"
#include "player/shard/shard_rows.h"
#include "player/frames/shots.h"

#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Frames to draw, and the rows of frames that are drawn.
class FrameShard {
public:
    // Reads --stats; throws as ShardRows. Without --shard it reads nothing: every frame is drawn.
    explicit FrameShard(const PlayOptions& options);

    // Chooses the frames to draw. `paths`: image files of all frames, the eyes of a frame side by side; empty if no images
    // are written.
    void plan(size_t frames, const std::vector<std::string>& paths, Reporter& log);

    [[nodiscard]] const std::vector<size_t>& frames() const { return m_frames; } // to draw
    [[nodiscard]] uint64_t own() const { return m_own; } // frames of the shard, drawn before or not
    // True if existing images of a frame may be replaced. A run that was killed may leave images of one frame without a row.
    [[nodiscard]] bool mayReplace(size_t frame) const;

    // To be called when the backend is known. Throws Error(Usage) if --stats has rows of other frames or options.
    void check(const std::vector<Shot>& shots, const std::string& backend, Tier tier);
    // Makes --stats, after check(), in a folder that exists. Throws Error(Io).
    void begin();
    // Adds the row of a frame, after its images are written, so that a row tells that the frame is whole.
    void add(size_t frame, const std::string& line);

private:
    [[nodiscard]] bool isDone(size_t frame, const std::vector<std::string>& paths) const;

    const PlayOptions& m_options;
    std::optional<ShardRows> m_rows; // none without --shard
    std::vector<size_t> m_frames;
    uint64_t m_own = 0;
    std::optional<size_t> m_cut; // frame that a killed run was drawing
};

} // namespace gsc
