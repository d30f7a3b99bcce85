// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench_scores.h"

#include <gsc/error.h>
#include "runtime/cli/setting_words.h"
#include "format/numbers/count_text.h"
#include "player/devices/open_renderer.h"
#include "player/frames/lod_target.h"
#include "player/measure/scorer.h"

#include <algorithm>
#include <map>

namespace gsc {

namespace {

// Frames to score. `in_order`: the path is played from a cold start up to the last scored frame.
ScoreOptions scoredFrames(const BenchOptions& options, uint64_t count, bool in_order)
{
    ScoreOptions score = options.score;
    if (options.scores_path)
        return score;
    const uint64_t scored = std::min<uint64_t>(options.quality, count);
    for (uint64_t i = 0; i < scored; ++i)
        score.listed.push_back(in_order ? (i + 1) * count / scored - 1 : i * count / scored);
    return score;
}

class BenchScorer {
public:
    BenchScorer(const Scene& scene, const Path& path, const FrameChoice& choice, Renderer& renderer,
                Renderer& reference, const StepDone& done)
        : m_path(path), m_renderer(renderer), m_done(done), m_frame(frameOptions(scene, choice)),
          m_guard(
              frameGuard(scene, choice, {drawsDetail(choice, renderer.id().backend, renderer.tierOf(choice.tier))})),
          m_loop(scene, path.shots, path.eye_count, m_frame, renderer, m_guard ? &*m_guard : nullptr),
          m_exact_loop(scene, path.shots, path.eye_count, exactOptions(m_frame), reference),
          m_place(scorePlace(renderer)), m_exact_memory(memoryFor(renderer.id(), !m_place.on_device, reference))
    {
    }

    // Sets the scored frames in `score`.
    Accuracy run(const BenchOptions& options, ScoreOptions& score)
    {
        const bool in_order = dependsOnPath(m_frame) || m_guard;
        score = scoredFrames(options, m_path.shots.size(), in_order);
        score.flip_every = m_frame.foveation.smallest > 0 ? 1 : 0;
        Scorer scorer(score, std::move(m_place.scorer));
        if (in_order)
            playAndScore(score, scorer);
        else
            for (size_t i = 0; i < m_path.shots.size(); ++i)
                if (score.scores(i)) {
                    const FramePictures images = takePictures(*m_place.memory, m_path.shots[i], m_path.eye_count);
                    (void)m_loop.draw(i, drawsInto(&images));
                    add(i, images, scorer);
                }
        return scorer.result();
    }

private:
    // Exact pictures are drawn last, because drawing them changes the caches of the renderer.
    void playAndScore(const ScoreOptions& score, Scorer& scorer)
    {
        const std::vector<Shot>& shots = m_path.shots;
        const uint64_t count = score.scoredOf(shots.size());
        uint64_t bytes = 0;
        for (uint64_t i = 0; i < count; ++i)
            bytes += pictureBytes(shots[score.frameOf(i)]) * m_path.eye_count;
        const std::shared_ptr<PictureMemory> memory =
            memoryToKeep(bytes, m_renderer.id(), !m_place.on_device, m_renderer);
        if (memory == nullptr)
            throw Error(ErrorCode::OutOfMemory, "--quality, --score-every",
                        formatString("the pictures of %s take %.1f GiB while the path is played",
                                     formatCount(count, "camera").c_str(), double(bytes) / double(1 << 30)),
                        "at most an eighth of the memory", "score fewer");
        std::map<uint64_t, FramePictures> played;
        m_renderer.dropCaches();
        m_loop.run(
            score.frameOf(count - 1) + 1, 1, [](size_t frame) { return frame; },
            [&](size_t i, LoopFrame& frame) {
                if (score.scores(i))
                    drawsInto (&(played[i] = takePictures(*memory, shots[i], m_path.eye_count)))(i, frame);
            },
            [&](size_t, LoopFrame&, const TimedFrame&) { step(); });
        for (const auto& [i, images] : played)
            add(i, images, scorer);
    }

    void step() { m_done(++m_steps); }

    void add(uint64_t number, const FramePictures& images, Scorer& scorer)
    {
        const Shot& shot = m_path.shots[number];
        const FramePictures exact = takePictures(*m_exact_memory, shot, m_path.eye_count);
        (void)m_exact_loop.draw(number, drawsInto(&exact));
        EyeParams eyes[kMaxEyes];
        shotEyes(shot, m_path.eye_count, eyes);
        for (uint32_t e = 0; e < m_path.eye_count; ++e) {
            const auto& at = m_frame.foveation.gaze[e];
            const EyeGaze gaze{eyes[e], at[0], at[1]};
            scorer.add(number, e, images.picture(e), exact.picture(e),
                       m_frame.foveation.smallest > 0 ? &gaze : nullptr);
        }
        step();
    }

    const Path& m_path;
    Renderer& m_renderer;
    const StepDone& m_done;
    uint64_t m_steps = 0;
    FrameOptions m_frame;
    std::optional<FrameGuard> m_guard;
    FrameLoop m_loop, m_exact_loop;
    ScorePlace m_place;
    std::shared_ptr<PictureMemory> m_exact_memory;
};

} // namespace

uint64_t scoreSteps(const BenchOptions& options, uint64_t cameras, bool in_order)
{
    const ScoreOptions score = scoredFrames(options, cameras, in_order);
    const uint64_t scored = score.scoredOf(cameras);
    return scored + (in_order && scored > 0 ? score.frameOf(scored - 1) + 1 : 0);
}

Accuracy scoreBench(const BenchOptions& options, const std::shared_ptr<const Scene>& scene, const Path& path,
                    const FrameChoice& choice, Renderer& renderer, RunContext& context, Reporter& log,
                    const StepDone& done)
{
    try {
        std::unique_ptr<Renderer> other;
        if (!options.reference.empty()) {
            double ignored = 0; // several devices are scored against one
            other =
                openRenderer(options.play.model, options.play.devices.alone(options.reference), scene, log, ignored);
        }
        Renderer& reference = other ? *other : renderer;
        context.reference = options.play.devices.device == 0 ? reference.id().backend : deviceText(reference.id());
        return BenchScorer(*scene, path, choice, renderer, reference, done).run(options, context.score);
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        log.warning(formatString("no accuracy: %s", warningText(e).c_str()));
        return {};
    }
}

} // namespace gsc
