// SPDX-License-Identifier: Apache-2.0
// The exact images of a path: kept, or drawn again for every run that is scored against them.
#pragma once

#include "player/measure/scorer.h"
#include "player/frames/path.h"
#include "player/measure/frame_pictures.h"
#include "runtime/frames/frame_loop.h"
#include <gsc/renderer.h>
#include <gsc/scene.h>

#include <memory>
#include <string>
#include <vector>

namespace gsc {

// Draws a frame of a FrameLoop into `images`; null leaves it on the device.
FrameLoop::Prepare drawsInto(const FramePictures* images);

// Images of tier exact without reuse and without caches, of the frames that `score` scores: what every run of the path is
// measured against.
class ExactImages {
public:
    // Background and near plane are those of `frame`. All must outlive this. `memory` is where the images are wanted.
    ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, const ScoreOptions& score,
                Renderer& renderer, std::shared_ptr<PictureMemory> memory = hostPictures(false));

    // Bytes of all of them.
    static uint64_t bytes(const Path& path, const ScoreOptions& score);

    // Renders and keeps all of them; the renderer is not used afterwards.
    void keepAll();

    // Rendered now unless kept; then the renderer must not be the one that is measured, whose caches it would disturb.
    // Valid until the next call. Precondition: the frame is scored.
    const FramePictures& images(size_t shot);

private:
    FramePictures render(size_t shot);

    const Path& m_path;
    ScoreOptions m_score;
    FrameLoop m_loop;
    std::shared_ptr<PictureMemory> m_memory;
    std::vector<FramePictures> m_kept; // per shot; empty unless kept
    FramePictures m_current;
};

} // namespace gsc
