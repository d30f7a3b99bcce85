// SPDX-License-Identifier: Apache-2.0
// Outputs of gsc-play: files, a stream or a video of pictures, and numbers of the frames.
#pragma once

#include <gsc/file/output_file.h>
#include <gsc/file/output_paths.h>
#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include "player/output/picture_stream.h"
#include "player/output/video_file.h"
#include "player/shard/frame_shard.h"
#include "runtime/cli/reporter.h"
#include "runtime/frames/frame_loop.h"

#include <optional>
#include <string>
#include <vector>

namespace gsc {

class PlayOutputs {
public:
    // Checks every file before the model is loaded, makes none, and plans `shard`. All must outlive this. Throws Error: Usage
    // also where pictures of different sizes would go into one stream or video; Io, Unsupported.
    PlayOutputs(const PlayOptions& options, const std::vector<Shot>& shots, FrameShard& shard, Reporter& log);
    // Once nothing else can be refused: makes folders, begins the shard's file, opens stream, video and statistics. Throws
    // Error(Io).
    void open(Reporter& log);

    // Writes the pictures of shot `shot` and its line of statistics, `stats`. Returns the picture files written, left
    // eye first. Throws Error(Io).
    std::vector<std::string> add(size_t shot, LoopFrame& drawn, const std::string& stats);
    // Completes the video and the statistics, after the last frame.
    void commit();

private:
    [[nodiscard]] std::vector<NamedPath> checkPaths(Reporter& log) const; // returns all files that will be written
    void checkOneSize() const;

    const PlayOptions& m_options;
    const std::vector<Shot>& m_shots;
    FrameShard& m_shard;
    size_t m_eyes;
    bool m_streams;                   // --out -
    std::vector<std::string> m_paths; // paths of the pictures of all shots, shot by shot; empty if they are not written
    std::vector<NamedPath> m_files;   // all files that will be written
    std::optional<PictureStream> m_stream;
    std::optional<VideoFile> m_video;
    std::optional<OutputFile> m_stats; // none of a shard, which keeps its own
};

} // namespace gsc
