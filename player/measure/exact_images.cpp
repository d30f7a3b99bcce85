// SPDX-License-Identifier: Apache-2.0
#include "player/measure/exact_images.h"

namespace gsc {

FrameLoop::Prepare drawsInto(const FramePictures* images)
{
    return [images](size_t, LoopFrame& frame) {
        frame.delivers = images != nullptr;
        for (uint32_t e = 0; frame.delivers && e < frame.eye_count; ++e)
            frame.targets[e] = images->target(e);
    };
}

ExactImages::ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, const ScoreOptions& score,
                         Renderer& renderer, std::shared_ptr<PictureMemory> memory)
    : m_path(path), m_score(score), m_loop(scene, path.shots, path.eye_count, exactOptions(frame), renderer),
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
    (void)m_loop.draw(shot, drawsInto(&images));
    return images;
}

void ExactImages::keepAll(const StepDone& done)
{
    std::vector<FramePictures> kept(m_path.shots.size());
    for (size_t i = 0; i < kept.size(); ++i) {
        if (m_score.scores(i))
            kept[i] = render(i);
        done(i + 1);
    }
    m_kept = std::move(kept);
}

const FramePictures& ExactImages::images(size_t shot)
{
    if (!m_kept.empty())
        return m_kept[shot];
    m_current = {}; // frees its memory for the next images
    return m_current = render(shot);
}

} // namespace gsc
