// SPDX-License-Identifier: Apache-2.0
// Exact images of a path: kept, or drawn again for every run that is scored against them.
#pragma once

#include "player/measure/scorer.h"
#include "player/frames/path.h"
#include "player/measure/frame_pictures.h"
#include "runtime/frames/frame_loop.h"
#include <gsc/renderer.h>
#include <gsc/scene.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// Called after each step of a measurement, with the number of steps so far.
using StepDone = std::function<void(uint64_t done)>;

// Makes a FrameLoop draw a frame into `images`; null leaves it on the device.
FrameLoop::Prepare drawsInto(const FramePictures* images);

// Reference of every run of a path: its scored frames in tier exact, without reuse and without caches.
class ExactImages {
public:
    // Background and near plane are those of `frame`. References must outlive this object. Images lie in `memory`.
    ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, const ScoreOptions& score,
                Renderer& renderer, std::shared_ptr<PictureMemory> memory = hostPictures(false));

    // Bytes of all images of a path.
    static uint64_t bytes(const Path& path, const ScoreOptions& score);

    // Draws and keeps all images; the renderer is not used afterwards. Calls `done` after each shot.
    void keepAll(const StepDone& done = [](uint64_t) {});

    // Images of a shot, drawn now unless kept. Valid until the next call. Precondition: the frame is scored; unless images
    // are kept, `renderer` is not the measured one, whose caches this would disturb.
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
