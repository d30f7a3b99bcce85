// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/export/measure_gaussians.h"

#include "convert/export/gaussian_render.h"
#include <gsc/interrupt.h>
#include <gsc/renderer.h>
#include "runtime/cameras/scene_cameras.h"
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/frames/frame_loop.h"
#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

namespace gsc {

namespace {

// Pictures that choose levels: so many, and so many pixels each at most. On trained models larger ones and more of them
// choose the same.
constexpr size_t kMostTrials = 6;
constexpr double kTrialPixels = 60'000;
// Shares of an anchor's views that may be asked to draw it.
constexpr float kShares[] = {0.25f, 0.5f, 0.75f};

using Drawn = std::function<void(size_t, LoopFrame&)>;

// Draws exact pictures one after the other.
void drawExact(const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& shots, int threads,
               const std::function<void(size_t)>& before, const Drawn& drawn)
{
    const std::unique_ptr<Renderer> exact = makeRenderer({"cpu"}, {threads});
    exact->load(scene);
    FrameLoop loop(*scene, shots, 1, exactOptions(modelOptions(*scene)), *exact);
    loop.run(
        shots.size(), 1, [](size_t i) { return i; },
        [&](size_t i, LoopFrame& frame) {
            before(i);
            frame.drawToHost();
        },
        [&](size_t i, LoopFrame& frame, const TimedFrame&) { drawn(i, frame); });
}

void shrink(Camera& camera)
{
    const double scale = std::sqrt(kTrialPixels / (double(camera.width) * camera.height));
    if (scale >= 1)
        return;
    camera.width = std::max(1u, uint32_t(std::lround(camera.width * scale)));
    camera.height = std::max(1u, uint32_t(std::lround(camera.height * scale)));
}

bool keeps(const GaussianSet& set, size_t i, const LevelSet& choice)
{
    return set.shown[i] >= choice.share && set.level[i] <= choice.finest;
}

// Exact pictures, and what candidates lose against them.
class Trial {
public:
    // `most`: largest number of candidates, for the progress
    Trial(GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& views, size_t most,
          int threads, Reporter& report)
        : m_report(report), m_set(set), m_opacity(set.opacity), m_rules(rasterConstants(*scene->view().params, 0)),
          m_renderer(set, scene->view().origin, threads)
    {
        std::vector<Shot> shots = takeEvenly(views, kMostTrials);
        for (Shot& shot : shots)
            shrink(shot.camera);
        m_drawn = shots.size();
        m_all = shots.size() * (1 + most);
        drawExact(
            scene, shots, threads, [&](size_t i) { report.progress("levels", i, m_all); },
            [&](size_t, LoopFrame& frame) {
                m_wanted.push_back({frame.eyes[0], std::move(frame.images[0])});
                std::copy_n(frame.options.background, 3, m_background);
            });
    }

    Trial(const Trial&) = delete;
    Trial& operator=(const Trial&) = delete;
    ~Trial() { m_set.opacity = std::move(m_opacity); }

    // PSNR of the candidate, pooled
    double score(const LevelSet& choice)
    {
        for (size_t i = 0; i < m_set.size(); ++i)
            m_set.opacity[i] = keeps(m_set, i, choice) ? m_opacity[i] : 0; // 0 is not drawn
        PooledDifference pooled;
        std::vector<float> drawn;
        for (const Wanted& wanted : m_wanted) {
            throwIfInterrupted();
            m_report.progress("levels", m_drawn++, m_all);
            drawn.resize(wanted.image.size());
            m_renderer.draw(wanted.eye, m_rules, m_background, drawn.data());
            pooled.add(compareImages({wanted.image.data(), wanted.eye.width, wanted.eye.height},
                                     {drawn.data(), wanted.eye.width, wanted.eye.height}));
        }
        return pooled.psnr();
    }

private:
    struct Wanted {
        EyeParams eye;
        std::vector<float> image;
    };

    Reporter& m_report;
    size_t m_drawn = 0, m_all = 0; // number of pictures drawn, and to draw at most
    GaussianSet& m_set;
    std::vector<float> m_opacity;
    RasterConstants m_rules;
    GaussianRenderer m_renderer;
    std::vector<Wanted> m_wanted;
    float m_background[3] = {};
};

} // namespace

GaussianLoss lossOf(const GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& judges,
                    int threads, Reporter& report)
{
    GaussianRenderer renderer(set, scene->view().origin, threads);
    const RasterConstants rules = rasterConstants(*scene->view().params, 0);
    GaussianLoss loss;
    PooledDifference pooled;
    drawExact(
        scene, judges, threads, [&](size_t i) { report.progress("compare", i, judges.size()); },
        [&](size_t, LoopFrame& wanted) {
            const EyeParams& eye = wanted.eyes[0];
            std::vector<float> drawn(wanted.images[0].size());
            renderer.draw(eye, rules, wanted.options.background, drawn.data());
            const ImageView a{wanted.images[0].data(), eye.width, eye.height};
            const ImageView b{drawn.data(), eye.width, eye.height};
            pooled.add(compareImages(a, b));
            loss.ssim += ssim(a, b) / double(judges.size());
        });
    loss.cameras = judges.size();
    loss.psnr = pooled.psnr();
    loss.worst_psnr = pooled.worst_psnr;
    loss.worst = judges[pooled.worst_frame].camera.name;
    return loss;
}

void keepLevels(GaussianSet& set, const LevelSet& choice)
{
    std::vector<uint32_t> kept;
    for (size_t i = 0; i < set.size(); ++i)
        if (keeps(set, i, choice))
            kept.push_back(uint32_t(i));
    keepOnly(set, kept);
}

std::vector<LevelTrial> tryLevels(GaussianSet& set, const std::shared_ptr<const Scene>& scene,
                                  const std::vector<Shot>& views, int threads, Reporter& report)
{
    const uint16_t finest = *std::ranges::max_element(set.level);
    Trial trial(set, scene, views, 1 + std::size(kShares) + finest, threads, report);
    std::vector<LevelTrial> tried;
    const auto attempt = [&](const LevelSet& choice) { tried.push_back({choice, trial.score(choice)}); };
    attempt({});
    for (const float share : kShares)
        attempt({.share = share});
    // fewer levels, until that is worse
    double last = tried[0].psnr;
    for (uint16_t level = finest; level-- > 0;) {
        attempt({.finest = level});
        if (tried.back().psnr < last)
            break;
        last = tried.back().psnr;
    }
    return tried;
}

} // namespace gsc
