// SPDX-License-Identifier: Apache-2.0
#include "player/measure/bench.h"

#include "format/error.h"
#include "format/interrupt.h"
#include "player/lod_target.h"
#include "player/open_backend.h"
#include "player/sweep/row_file.h"
#include "player/shots.h"
#include "runtime/scene.h"

#include <algorithm>
#include <chrono>
#include <memory>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start)
{
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class Bench {
public:
    Bench(const BenchOptions& options, const Scene& scene, Backend& backend, const std::vector<Shot>& shots)
        : m_options(options.play), m_scene(scene), m_backend(backend), m_shots(shots),
          m_frame(frameOptions(scene, options.play)), m_control(lodControl(scene, options.play))
    {
    }

    // Frame `i` of a run that goes round the shots.
    BenchFrame time(uint64_t i)
    {
        throwIfInterrupted();
        const Shot& shot = m_shots[i % m_shots.size()];
        EyeParams eyes[kMaxEyes];
        shotEyes(shot, eyeCount(), eyes);
        m_frame.tier = m_options.tier;
        m_frame.appearance = shotAppearance(m_scene, shot);
        BenchFrame frame;
        if (m_control)
            m_frame.lod_bias = float(m_control->bias());
        frame.lod_bias = double(m_frame.lod_bias);
        frame.pixels = double(shot.camera.width) * shot.camera.height;
        const Clock::time_point start = Clock::now();
        m_backend.render(eyes, eyeCount(), m_frame, nullptr, frame.result);
        frame.wall_ms = millisecondsSince(start);
        if (m_control)
            m_control->add(frame.result.times.total);
        return frame;
    }

    // Adds every eye of a shot, rendered in the tier asked for and in `exact` by `reference`.
    void score(const Shot& shot, Backend& reference, PooledDifference& pool)
    {
        throwIfInterrupted();
        EyeParams eyes[kMaxEyes];
        shotEyes(shot, eyeCount(), eyes);
        m_frame.appearance = shotAppearance(m_scene, shot);
        m_frame.lod_fade = float(m_options.lod_fade);
        render(m_backend, eyes, shot, {m_options.tier, m_options.stereo, m_options.reuse}, m_images);
        m_frame.lod_fade = 0;
        render(reference, eyes, shot, {Tier::Exact, StereoMode::Exact, {}}, m_exact);
        for (uint32_t e = 0; e < eyeCount(); ++e) {
            const auto view = [&](const std::vector<float>& pixels) {
                return ImageView{pixels.data(), shot.camera.width, shot.camera.height};
            };
            pool.add(compareImages(view(m_images[e]), view(m_exact[e])));
        }
    }

private:
    [[nodiscard]] uint32_t eyeCount() const { return uint32_t(m_options.eyes); }

    struct Way {
        Tier tier;
        StereoMode stereo;
        ReuseOptions reuse;
    };

    void render(Backend& backend, const EyeParams* eyes, const Shot& shot, const Way& way, std::vector<float>* images)
    {
        float* pixels[kMaxEyes] = {};
        for (uint32_t e = 0; e < eyeCount(); ++e) {
            images[e].resize(size_t(shot.camera.width) * shot.camera.height * 3);
            pixels[e] = images[e].data();
        }
        m_frame.tier = way.tier;
        m_frame.stereo = way.stereo;
        m_frame.reuse = way.reuse;
        FrameResult result;
        backend.render(eyes, eyeCount(), m_frame, pixels, result);
    }

    const PlayOptions& m_options;
    const Scene& m_scene;
    Backend& m_backend;
    const std::vector<Shot>& m_shots;
    FrameOptions m_frame;
    std::optional<LodControl> m_control;
    std::vector<float> m_images[kMaxEyes], m_exact[kMaxEyes];
};

// A device whose memory the model fills has no room left to measure in; the frames are measured all the same.
DeviceCeilings ceilingsOf(Backend& backend, Reporter& log)
{
    try {
        return backend.ceilings();
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        log.warning(formatString("no floors: the device's ceilings could not be measured: %s", e.what()));
        return {};
    }
}

// Compares some of the shots with the tier exact. The timings are not lost if there is no memory for that.
void scoreShots(const BenchOptions& options, const Scene& scene, const std::vector<Shot>& shots, Backend& backend,
                Bench& run, BenchSummary& summary, Reporter& log)
{
    try {
        std::unique_ptr<Backend> other;
        if (!options.reference.empty()) {
            other = makeBackend(options.reference, options.play.threads);
            other->load(scene.view());
        }
        Backend& reference = other ? *other : backend;
        summary.reference = reference.name();
        const uint64_t scored = std::min<uint64_t>(options.quality, shots.size());
        for (uint64_t i = 0; i < scored; ++i) // spread over the shots
            run.score(shots[i * shots.size() / scored], reference, summary.quality);
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        summary.quality = {};
        log.warning(formatString("no accuracy: %s", e.what()));
    }
}

} // namespace

BenchSummary bench(const BenchOptions& options, Reporter& log)
{
    std::vector<NamedPath> inputs;
    if (options.play.cameras != "stored")
        inputs.push_back({options.play.cameras, "the camera file"});
    checkRowOutput(options, inputs, log.json());
    if (const RowFile rows = readBenchRows(options.out); !rows.cut_off.empty())
        log.warning(rows.cut_off);
    BenchSummary summary;
    const Clock::time_point open_start = Clock::now();
    const std::unique_ptr<Scene> scene = Scene::open(options.play.input, options.play.verify);
    summary.open_ms = millisecondsSince(open_start);
    summary.anchors = scene->anchorCount();
    summary.file_bytes = scene->bytes();
    const std::vector<Shot> shots = chooseShots(*scene, options.play, log);
    summary.shots = shots.size();

    const std::unique_ptr<Backend> backend = openBackend(options.play, *scene, log, summary.load_ms);
    summary.backend = backend->name();
    summary.ipd = shots.front().ipd;

    Bench run(options, *scene, *backend, shots);
    const uint64_t total = uint64_t(options.warmup) + options.measured;
    for (uint64_t i = 0; i < total; ++i) {
        // the measured frames start at the first shot whatever the warm-up was
        const bool measured = i >= options.warmup;
        const BenchFrame frame = run.time(measured ? i - options.warmup : i);
        if (measured)
            summary.frames.push_back(frame);
        else
            summary.warm_bytes = std::max(summary.warm_bytes, frame.result.bytes_resident);
        log.progress("render", i + 1, total);
    }
    summary.device = backend->device();
    summary.tier = backend->tierOf(options.play.tier);
    summary.anchor_cost = anchorCost(scene->view(), summary.tier);
    summary.ceilings = ceilingsOf(*backend, log);

    if (options.quality > 0)
        scoreShots(options, *scene, shots, *backend, run, summary, log);
    summary.warnings = log.warnings();
    return summary;
}

} // namespace gsc
