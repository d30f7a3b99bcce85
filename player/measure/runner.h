// SPDX-License-Identifier: Apache-2.0
// Draws a path once, from a cold start, and measures time and accuracy of its frames.
#pragma once

#include "player/measure/exact_images.h"

#include <memory>
#include <string>
#include <vector>

namespace gsc {

// Throws Error(Usage) if no frame of the path would be scored. `what` names the option, or the file and its key.
void checkScored(const ScoreOptions& score, const Path& path, const std::string& what);

// Times of all frames, and accuracy of the scored ones.
struct RunResult {
    std::vector<TimedFrame> frames;
    Accuracy accuracy;
    Tier tier = Tier::Exact; // tier that the backend drew
    DeviceFacts device;      // read after the last timed frame
};

// True if a frame depends on the frames before it.
bool dependsOnPath(const FrameOptions& frame);

// Scorer of a renderer's pictures, and the memory that the renderer draws them into for it.
struct ScorePlace {
    std::unique_ptr<PictureScorer> scorer;
    std::shared_ptr<PictureMemory> memory;
    bool on_device = false; // the scorer is on the renderer's device
};
// Scores on the renderer's device if that is a GPU, else on the host. Throws Error(Device).
ScorePlace scorePlace(const Renderer& renderer);

// Memory in which `drawing` draws pictures that the device `scoring`, or the host if `on_host`, scores: memory of that device
// if `drawing` is on it, else of the host.
std::shared_ptr<PictureMemory> memoryFor(const DeviceId& scoring, bool on_host, const Renderer& drawing);

// Memory as from memoryFor(), for `bytes` of pictures that are kept. On the device at most half of its free memory is used:
// frames may grow, and need more passes if memory is short. On the host it is at most an eighth of the memory that this
// process may use. Null if `bytes` are more than either.
std::shared_ptr<PictureMemory> memoryToKeep(uint64_t bytes, const DeviceId& scoring, bool on_host,
                                            const Renderer& drawing);
bool mayKeepOnHost(uint64_t bytes); // true up to an eighth of the memory that this process may use

// Steps of a run for each frame: it is drawn and timed, then drawn again, scored or left out.
constexpr uint64_t kStepsOfFrame = 2;

// Draws the frames in order, after dropCaches(); times leave out scoring. A renderer on the host draws a block of frames,
// then scores them, because its images are on the host anyway. Any other renderer is timed with its images left on the
// device, then draws the path again for the scores. Throws Error (Interrupted, OutOfMemory, Device).
RunResult measureRun(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer,
                     ExactImages& exact, const ScoreOptions& score, const StepDone& done);

} // namespace gsc
