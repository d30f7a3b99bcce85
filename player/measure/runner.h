// SPDX-License-Identifier: Apache-2.0
// Renders a path once, from a cold start, and says what its frames cost and how far they are from exact.
#pragma once

#include "player/measure/exact_images.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// Throws Error(Usage) where no frame of the path would be scored. `what` is the option or the key of a file.
void checkScored(const ScoreOptions& score, const Path& path, const std::string& what);

using FrameDone = std::function<void(uint64_t done)>; // frames, from 1

struct RunResult {
    std::vector<TimedFrame> frames;
    Accuracy accuracy;
    Tier tier = Tier::Exact; // that ran
    DeviceFacts device;      // asked for after the last timed frame
};

// Does a frame depend on those before it?
bool dependsOnPath(const FrameOptions& frame);

// Where pictures of a renderer are scored, and the memory that it draws them into for that.
struct ScorePlace {
    std::unique_ptr<PictureScorer> scorer;
    std::shared_ptr<PictureMemory> memory;
    bool on_device = false; // of the scorer
};
// On the renderer's device where that is a GPU. Throws Error(Device).
ScorePlace scorePlace(const Renderer& renderer);

// Memory that `drawing` draws pictures into for the device `scoring`, or (`on_host`) the host, to score: of that device where
// it can.
std::shared_ptr<PictureMemory> memoryFor(const DeviceId& scoring, bool on_host, const Renderer& drawing);

// As memoryFor(), for `bytes` of pictures that stay: of the device up to half of the memory free there (frames that
// grow need some, and where memory is short they are drawn in more passes); else of the host, up to an eighth of the
// memory that this process may use. Null where `bytes` are more.
std::shared_ptr<PictureMemory> memoryToKeep(uint64_t bytes, const DeviceId& scoring, bool on_host,
                                            const Renderer& drawing);
bool mayKeepOnHost(uint64_t bytes);

// Frames in order, after dropCaches(). Scoring is no part of the times. A renderer on the host is timed and
// scored in one pass, because its images are on the host anyway, a block of frames at a time; any other is timed with
// its images left on the device and renders the path again for the scores. Throws Error (Interrupted, OutOfMemory,
// Device).
RunResult measureRun(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer,
                     ExactImages& exact, const ScoreOptions& score, const FrameDone& done);

} // namespace gsc
