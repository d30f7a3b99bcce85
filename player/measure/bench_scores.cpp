// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench_scores.h"

#include <gsc/error.h>
#include "player/frames/lod_target.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_report.h"

#include <algorithm>
#include <map>

namespace gsc {

namespace {

// `in_order`: a path is played up to the last, which is then the path's: the first is drawn from a cold start.
std::vector<uint64_t> scoredShots(const BenchOptions& options, uint64_t count, bool in_order)
{
    std::vector<uint64_t> shots;
    if (options.scores_path) {
        for (uint64_t i = 0; i < count; ++i)
            if (options.score.scores(i))
                shots.push_back(i);
    } else {
        const uint64_t scored = std::min<uint64_t>(options.quality, count);
        for (uint64_t i = 0; i < scored; ++i)
            shots.push_back(in_order ? (i + 1) * count / scored - 1 : i * count / scored);
    }
    return shots;
}

class BenchScorer {
public:
    BenchScorer(const BenchOptions& options, const Scene& scene, const std::vector<Shot>& shots, Renderer& renderer,
                Renderer& reference, BenchSummary& summary)
        : m_options(options), m_shots(shots), m_eye_count(uint32_t(options.play.view.eyes)), m_renderer(renderer),
          m_summary(summary), m_frame(frameOptions(scene, summary.frame)),
          m_guard(frameGuard(scene, summary.frame, {drawsDetail(summary.frame, renderer.id().backend, summary.tier)})),
          m_loop(scene, shots, m_eye_count, m_frame, renderer, m_guard ? &*m_guard : nullptr),
          m_exact_loop(scene, shots, m_eye_count, exactOptions(m_frame), reference), m_place(scorePlace(renderer)),
          m_exact_memory(memoryFor(renderer.id(), !m_place.on_device, reference))
    {
    }

    void run()
    {
        const bool in_order = dependsOnPath(m_frame) || m_guard;
        const std::vector<uint64_t> scored = scoredShots(m_options, m_shots.size(), in_order);
        m_summary.scored = scored;
        if (in_order)
            playAndScore(scored);
        else
            for (const uint64_t i : scored) {
                const FramePictures images = takePictures(*m_place.memory, m_shots[i], m_eye_count);
                (void)m_loop.draw(i, drawsInto(&images));
                score(i, images);
            }
        if (!m_fovea.empty())
            m_summary.fovea = m_fovea.result();
    }

private:
    // The exact pictures come last: to draw them would change what the renderer keeps.
    void playAndScore(const std::vector<uint64_t>& scored)
    {
        uint64_t bytes = 0;
        for (const uint64_t i : scored)
            bytes += pictureBytes(m_shots[i]) * m_eye_count;
        const std::shared_ptr<PictureMemory> memory =
            memoryToKeep(bytes, m_renderer.id(), !m_place.on_device, m_renderer);
        if (memory == nullptr)
            throw Error(ErrorCode::OutOfMemory, "--quality, --score-every",
                        formatString("the pictures of %zu cameras take %.1f GiB while the path is played",
                                     scored.size(), double(bytes) / double(1 << 30)),
                        "at most an eighth of the memory", "score fewer");
        std::map<uint64_t, FramePictures> played;
        m_renderer.dropCaches();
        m_loop.run(
            scored.back() + 1, 1, [](size_t frame) { return frame; },
            [&](size_t i, LoopFrame& frame) {
                if (std::ranges::binary_search(scored, i))
                    drawsInto (&(played[i] = takePictures(*memory, m_shots[i], m_eye_count)))(i, frame);
            },
            [](size_t, LoopFrame&, const TimedFrame&) {});
        for (const auto& [i, images] : played)
            score(i, images);
    }

    void score(uint64_t number, const FramePictures& images)
    {
        const Shot& shot = m_shots[number];
        const FramePictures exact = takePictures(*m_exact_memory, shot, m_eye_count);
        (void)m_exact_loop.draw(number, drawsInto(&exact));
        EyeParams eyes[kMaxEyes];
        shotEyes(shot, m_eye_count, eyes);
        const bool foveated = m_frame.foveation.smallest > 0;
        for (uint32_t e = 0; e < m_eye_count; ++e) {
            const auto& at = m_frame.foveation.gaze[e];
            const EyeGaze gaze{eyes[e], at[0], at[1]};
            const PictureScores scores = m_place.scorer->score(e, images.picture(e), exact.picture(e),
                                                               {false, foveated, foveated ? &gaze : nullptr});
            m_summary.quality.add({scores.mse, scores.psnr, scores.max_error});
            if (foveated)
                m_fovea.add(number, scores.fovea);
        }
    }

    const BenchOptions& m_options;
    const std::vector<Shot>& m_shots;
    uint32_t m_eye_count;
    Renderer& m_renderer;
    BenchSummary& m_summary;
    FrameOptions m_frame;
    std::optional<FrameGuard> m_guard;
    FrameLoop m_loop, m_exact_loop;
    ScorePlace m_place;
    std::shared_ptr<PictureMemory> m_exact_memory;
    FoveaScorer m_fovea;
};

} // namespace

void scoreBench(const BenchOptions& options, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& shots,
                Renderer& renderer, BenchSummary& summary, Reporter& log)
{
    try {
        std::unique_ptr<Renderer> other;
        if (!options.reference.empty()) {
            double ignored = 0; // what several devices draw is measured against one
            other =
                openRenderer(options.play.model, options.play.devices.alone(options.reference), scene, log, ignored);
        }
        Renderer& reference = other ? *other : renderer;
        summary.reference = deviceText(reference.id());
        BenchScorer(options, *scene, shots, renderer, reference, summary).run();
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        summary.quality = {};
        summary.fovea.reset();
        log.warning(formatString("no accuracy: %s", e.what()));
    }
}

} // namespace gsc
