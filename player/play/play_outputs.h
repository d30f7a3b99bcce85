// SPDX-License-Identifier: Apache-2.0
// Outputs of gsc-play: image files, a stream or a video, and numbers of the frames.
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
    // Checks every output path before the model is loaded, creates no file yet, and plans the frames of `shard`. The
    // arguments must outlive this object. Throws Error: Usage, also if pictures of different sizes would go into one
    // stream or video; Io, Unsupported.
    PlayOutputs(const PlayOptions& options, const std::vector<Shot>& shots, FrameShard& shard, Reporter& log);
    // Makes folders and opens the shard's file, the stream, the video and the statistics. Call it once nothing else
    // can be refused. Throws Error(Io).
    // `fps`: frames per second of the stream and the video.
    void open(double fps, Reporter& log);

    // Writes the pictures of shot number `shot` and the line `stats` of numbers. Returns the paths of the written
    // images, left eye first. Throws Error(Io).
    std::vector<std::string> add(size_t shot, LoopFrame& drawn, const std::string& stats);
    // Completes the video and the statistics; call it after the last frame.
    void commit();

private:
    // returns the paths of all files that will be written
    [[nodiscard]] std::vector<NamedPath> checkPaths(Reporter& log) const;
    void checkOneSize() const;

    const PlayOptions& m_options;
    const std::vector<Shot>& m_shots;
    FrameShard& m_shard;
    size_t m_eyes;
    bool m_streams; // true: pictures are streamed to standard output (--out -)
    // paths of the pictures of all shots, shot by shot; empty if no images are written
    std::vector<std::string> m_paths;
    std::vector<NamedPath> m_files; // paths of all files that will be written, for checks
    std::optional<PictureStream> m_stream;
    std::optional<VideoFile> m_video;
    std::optional<OutputFile> m_stats; // statistics of all frames; none for a shard, which writes a file of its own
};

} // namespace gsc
