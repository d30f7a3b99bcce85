// SPDX-License-Identifier: Apache-2.0
#include "player/measure/exact_images.h"

#include <gsc/interrupt.h>

#include <chrono>

namespace gsc {

TimedFrame renderShot(const Scene& scene, const Shot& shot, uint32_t eye_count, FrameOptions& frame, Renderer& renderer,
                      const FramePictures* images)
{
    using Clock = std::chrono::steady_clock;
    throwIfInterrupted();
    EyeParams eyes[kMaxEyes];
    shotEyes(shot, eye_count, eyes);
    frame.appearance = shotAppearance(scene, shot);
    FrameTarget targets[kMaxEyes];
    for (uint32_t e = 0; images != nullptr && e < eye_count; ++e)
        targets[e] = images->target(e);
    FrameRequest request{{eyes, eye_count}, {}, frame};
    if (images != nullptr)
        request.targets = {targets, eye_count};
    TimedFrame timed{0, {}, double(shot.camera.width) * shot.camera.height, double(frame.lod_bias)};
    const Clock::time_point start = Clock::now();
    timed.result = render(renderer, request);
    timed.wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    return timed;
}

ExactImages::ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, const ScoreOptions& score,
                         Renderer& renderer, std::shared_ptr<PictureMemory> memory)
    : m_scene(scene), m_path(path), m_frame(exactOptions(frame)), m_score(score), m_renderer(renderer),
      m_memory(std::move(memory))
{
}

uint64_t ExactImages::bytes(const Path& path, const ScoreOptions& score)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < path.shots.size(); ++i)
        if (score.scores(i))
            bytes += pictureBytes(path.shots[i]) * path.eye_count;
    return bytes;
}

FramePictures ExactImages::render(size_t shot)
{
    const FramePictures images = takePictures(*m_memory, m_path.shots[shot], m_path.eye_count);
    (void)renderShot(m_scene, m_path.shots[shot], m_path.eye_count, m_frame, m_renderer, &images);
    return images;
}

void ExactImages::keepAll()
{
    std::vector<FramePictures> kept(m_path.shots.size());
    for (size_t i = 0; i < kept.size(); ++i)
        if (m_score.scores(i))
            kept[i] = render(i);
    m_kept = std::move(kept);
}

const FramePictures& ExactImages::images(size_t shot)
{
    if (!m_kept.empty())
        return m_kept[shot];
    m_current = {}; // its memory is used again
    return m_current = render(shot);
}

} // namespace gsc
