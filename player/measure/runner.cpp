// SPDX-License-Identifier: Apache-2.0
#include "player/measure/runner.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "format/machine/machine.h"
#include "runtime/devices/device_scorer.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace gsc {

namespace {

size_t valuesOf(const Shot& shot)
{
    return size_t(shot.camera.width) * shot.camera.height * 3;
}

// Number of frames that are timed before they are scored. Scoring after each frame would fill the processor's caches with
// pictures, and slow the next frame by some per cent.
size_t blockSize(const Path& path)
{
    constexpr uint64_t kBlockBytes = uint64_t(128) << 20;
    uint64_t largest = 1;
    for (const Shot& shot : path.shots)
        largest = std::max<uint64_t>(largest, valuesOf(shot) * sizeof(float) * path.eye_count);
    return std::clamp<size_t>(kBlockBytes / largest, 1, path.shots.size());
}

} // namespace

void checkScored(const ScoreOptions& score, const Path& path, const std::string& what)
{
    if (score.first >= path.shots.size())
        throw Error(ErrorCode::Usage,
                    formatString("%s %llu", what.c_str(), static_cast<unsigned long long>(score.first)),
                    formatString("lies behind the last frame of %s",
                                 path.name == "stored" ? "the stored cameras" : path.name.c_str()),
                    formatString("at most %zu", path.shots.size() - 1), "state a frame of it");
}

bool dependsOnPath(const FrameOptions& frame)
{
    return frame.reuse.policy != ReusePolicy::None || frame.detail > 0 || frame.lod_hysteresis > 0;
}

std::shared_ptr<PictureMemory> memoryFor(const DeviceId& scoring, bool on_host, const Renderer& drawing)
{
    const bool on_device = !on_host && drawing.id() == scoring && drawing.takesDeviceTargets();
    return on_device ? devicePictures(scoring) : hostPictures(!on_host);
}

ScorePlace scorePlace(const Renderer& renderer)
{
    ScorePlace place;
    place.scorer = makeDeviceScorer(renderer);
    place.on_device = place.scorer != nullptr;
    if (!place.on_device)
        place.scorer = makeHostScorer();
    place.memory = memoryFor(renderer.id(), !place.on_device, renderer);
    return place;
}

bool mayKeepOnHost(uint64_t bytes)
{
    return bytes <= usableMemory() / 8;
}

std::shared_ptr<PictureMemory> memoryToKeep(uint64_t bytes, const DeviceId& scoring, bool on_host,
                                            const Renderer& drawing)
{
    std::shared_ptr<PictureMemory> memory = memoryFor(scoring, on_host, drawing);
    if (memory->kind() == FrameTarget::Kind::Device && bytes <= freeDeviceBytes(scoring) / 2)
        return memory;
    return mayKeepOnHost(bytes) ? hostPictures(!on_host) : nullptr;
}

namespace {

// One run, measured and scored.
class Run {
public:
    Run(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer, ExactImages& exact,
        const ScoreOptions& score, const StepDone& done)
        : m_path(path), m_frame(frame), m_renderer(renderer),
          m_loop(scene, path.shots, path.eye_count, frame, renderer), m_exact(exact), m_score(score), m_done(done),
          m_place(scorePlace(renderer)), m_scorer(score, std::move(m_place.scorer))
    {
    }

    RunResult result()
    {
        RunResult run;
        run.tier = m_renderer.tierOf(m_frame.tier);
        m_renderer.dropCaches();
        m_renderer.onHost() ? timeAndScore(run) : time(run);
        run.device = m_renderer.device();
        if (!m_renderer.onHost())
            drawAndScore();
        run.accuracy = m_scorer.result();
        return run;
    }

private:
    void step() { m_done(++m_steps); }

    TimedFrame draw(size_t shot, const FramePictures* images) { return m_loop.draw(shot, drawsInto(images)); }

    void time(RunResult& run)
    {
        m_loop.run(
            m_path.shots.size(), 1, [](size_t frame) { return frame; }, nullptr,
            [&](size_t, LoopFrame&, const TimedFrame& timed) {
                run.frames.push_back(timed);
                step();
            });
    }

    // Times a block of frames, then scores it. All frames are drawn into one picture, as in a player, and copied to be scored.
    void timeAndScore(RunResult& run)
    {
        const size_t frames = m_path.shots.size(), block = blockSize(m_path);
        std::vector<FramePictures> drawn(block);
        FramePictures current;
        for (size_t i = 0; i < frames; ++i) {
            const Shot& shot = m_path.shots[i];
            if (current.width != shot.camera.width || current.height != shot.camera.height)
                current = takePictures(*m_place.memory, shot, m_path.eye_count);
            run.frames.push_back(draw(i, &current));
            step();
            if (m_score.scores(i)) {
                FramePictures& copy = drawn[i % block] = takePictures(*m_place.memory, shot, m_path.eye_count);
                for (uint32_t e = 0; e < m_path.eye_count; ++e)
                    std::memcpy(copy.eyes[e].get(), current.eyes[e].get(), pictureBytes(shot));
            }
            for (size_t k = i / block * block; k <= i && (i + 1 == frames || (i + 1) % block == 0); ++k) {
                if (m_score.scores(k))
                    scoreShot(k, std::exchange(drawn[k % block], {}));
                step();
            }
        }
    }

    // Draws the scored frames again and scores them; draws the frames between them only if scored frames depend on them.
    void drawAndScore()
    {
        const bool all = dependsOnPath(m_frame);
        m_renderer.dropCaches();
        for (size_t i = 0; i < m_path.shots.size(); ++i) {
            if (m_score.scores(i)) {
                FramePictures images = takePictures(*m_place.memory, m_path.shots[i], m_path.eye_count);
                (void)draw(i, &images);
                scoreShot(i, images);
            } else if (all) {
                (void)draw(i, nullptr);
            }
            step();
        }
    }

    void scoreShot(size_t shot, const FramePictures& images)
    {
        throwIfInterrupted();
        const FramePictures& expected = m_exact.images(shot);
        EyeParams eyes[kMaxEyes];
        shotEyes(m_path.shots[shot], m_path.eye_count, eyes);
        for (uint32_t e = 0; e < m_path.eye_count; ++e) {
            const EyeGaze gaze{eyes[e], m_frame.foveation.gaze[e][0], m_frame.foveation.gaze[e][1]};
            m_scorer.add(shot, e, images.picture(e), expected.picture(e),
                         m_frame.foveation.smallest > 0 ? &gaze : nullptr);
        }
    }

    const Path& m_path;
    FrameOptions m_frame;
    Renderer& m_renderer;
    FrameLoop m_loop;
    ExactImages& m_exact;
    const ScoreOptions& m_score;
    const StepDone& m_done;
    uint64_t m_steps = 0;
    ScorePlace m_place;
    Scorer m_scorer;
};

} // namespace

RunResult measureRun(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer,
                     ExactImages& exact, const ScoreOptions& score, const StepDone& done)
{
    return Run(scene, path, frame, renderer, exact, score, done).result();
}

} // namespace gsc
