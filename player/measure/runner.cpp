// SPDX-License-Identifier: Apache-2.0
#include "player/measure/runner.h"

#include "format/interrupt.h"

#include <algorithm>
#include <chrono>
#include <filesystem>

namespace gsc {

namespace {

using Clock = std::chrono::steady_clock;

size_t valuesOf(const Shot& shot)
{
    return size_t(shot.camera.width) * shot.camera.height * 3;
}

// Frames that are timed one after another before they are scored: scoring between two frames leaves the processor's
// caches full of pictures, which costs the next one some per cent.
size_t blockSize(const Path& path, bool together)
{
    constexpr uint64_t kBlockBytes = uint64_t(128) << 20;
    uint64_t largest = 1;
    for (const Shot& shot : path.shots)
        largest = std::max<uint64_t>(largest, valuesOf(shot) * sizeof(float) * path.eye_count);
    return together ? std::clamp<size_t>(kBlockBytes / largest, 1, path.shots.size()) : 1;
}

} // namespace

Path openPath(const Scene& scene, const PlayOptions& options, const std::string& listed, Reporter& log)
{
    Path path;
    path.shots = chooseShots(scene, options, log, &path.name);
    path.cameras = listed;
    path.eye_count = uint32_t(options.eyes);
    if (path.name.empty())
        path.name = std::filesystem::path(listed).stem().string();
    return path;
}

struct ShotsInFlight::Flying {
    EyeParams eyes[kMaxEyes];
    std::vector<float> pixels[kMaxEyes];
    FrameTarget targets[kMaxEyes];
    FrameRequest request;
    uint64_t ticket = 0;
    TimedFrame timed;
    Clock::time_point start;
};

ShotsInFlight::ShotsInFlight(const Scene& scene, uint32_t eye_count, Renderer& renderer)
    : m_scene(scene), m_eye_count(eye_count), m_renderer(renderer)
{
}

// The renderer draws into pictures that go with this.
ShotsInFlight::~ShotsInFlight()
{
    for (const std::unique_ptr<Flying>& flying : m_flying)
        try {
            FrameResult ignored;
            (void)m_renderer.wait(flying->ticket, ignored);
        } catch (...) { // one that was never submitted, or what has failed already
        }
}

void ShotsInFlight::begin(const Shot& shot, FrameOptions& frame)
{
    throwIfInterrupted();
    m_flying.push_back(m_spare ? std::move(m_spare) : std::make_unique<Flying>());
    Flying& flying = *m_flying.back();
    shotEyes(shot, m_eye_count, flying.eyes);
    frame.appearance = shotAppearance(m_scene, shot);
    for (uint32_t e = 0; e < m_eye_count; ++e) {
        flying.pixels[e].resize(valuesOf(shot));
        flying.targets[e] = hostTarget(flying.pixels[e].data());
    }
    flying.request = {{flying.eyes, m_eye_count}, {flying.targets, m_eye_count}, frame};
    flying.timed = {0, {}, double(shot.camera.width) * shot.camera.height, double(frame.lod_bias)};
    flying.start = Clock::now();
    flying.ticket = m_renderer.submit(flying.request);
}

TimedFrame ShotsInFlight::end(std::vector<float>* images)
{
    Flying& flying = *m_flying.front();
    flying.timed.result = finish(m_renderer, flying.request, flying.ticket);
    flying.timed.wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - flying.start).count();
    for (uint32_t e = 0; e < m_eye_count; ++e)
        std::swap(images[e], flying.pixels[e]);
    m_spare = std::move(m_flying.front());
    m_flying.pop_front();
    return m_spare->timed;
}

TimedFrame renderShot(const Scene& scene, const Shot& shot, uint32_t eye_count, FrameOptions& frame, Renderer& renderer,
                      std::vector<float>* images)
{
    throwIfInterrupted();
    EyeParams eyes[kMaxEyes];
    shotEyes(shot, eye_count, eyes);
    frame.appearance = shotAppearance(scene, shot);
    float* pixels[kMaxEyes] = {};
    for (uint32_t e = 0; images && e < eye_count; ++e) {
        images[e].resize(valuesOf(shot));
        pixels[e] = images[e].data();
    }
    TimedFrame timed{0, {}, double(shot.camera.width) * shot.camera.height, double(frame.lod_bias)};
    const Clock::time_point start = Clock::now();
    timed.result = render(renderer, {eyes, eye_count}, frame, images ? pixels : nullptr);
    timed.wall_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    return timed;
}

ExactImages::ExactImages(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer)
    : m_scene(scene), m_path(path), m_frame(exactOptions(frame)), m_renderer(renderer)
{
}

bool ExactImages::fit(const Path& path, uint64_t budget)
{
    uint64_t bytes = 0;
    for (const Shot& shot : path.shots)
        bytes += valuesOf(shot) * sizeof(float) * path.eye_count;
    return bytes <= budget;
}

void ExactImages::render(size_t shot, std::vector<float>* images)
{
    (void)renderShot(m_scene, m_path.shots[shot], m_path.eye_count, m_frame, m_renderer, images);
}

void ExactImages::keepAll()
{
    std::vector<std::vector<float>> kept(m_path.shots.size() * kMaxEyes);
    for (size_t i = 0; i < m_path.shots.size(); ++i)
        render(i, &kept[i * kMaxEyes]);
    m_kept = std::move(kept);
}

const std::vector<float>* ExactImages::images(size_t shot)
{
    if (!m_kept.empty())
        return &m_kept[shot * kMaxEyes];
    render(shot, m_current);
    return m_current;
}

RunResult measureRun(const Scene& scene, const Path& path, const FrameOptions& frame, Renderer& renderer,
                     ExactImages& exact, const ScoreOptions& score, const FrameDone& done)
{
    RunResult run;
    run.tier = renderer.tierOf(frame.tier);
    const bool together = renderer.onHost();
    FrameOptions options = frame;
    Scorer scorer(score);
    const size_t frames = path.shots.size(), block = blockSize(path, together);
    std::vector<std::vector<float>> images(block * kMaxEyes);
    std::vector<float> current[kMaxEyes]; // the same memory for every frame, as a player has it
    const auto scoreShot = [&](size_t i) {
        throwIfInterrupted();
        const Camera& camera = path.shots[i].camera;
        const std::vector<float>* expected = exact.images(i);
        const std::vector<float>* rendered = &images[i % block * kMaxEyes];
        EyeParams eyes[kMaxEyes];
        shotEyes(path.shots[i], path.eye_count, eyes);
        for (uint32_t e = 0; e < path.eye_count; ++e) {
            const EyeGaze gaze{eyes[e], frame.foveation.gaze[e][0], frame.foveation.gaze[e][1]};
            scorer.add(i, e, {rendered[e].data(), camera.width, camera.height},
                       {expected[e].data(), camera.width, camera.height},
                       frame.foveation.smallest > 0 ? &gaze : nullptr);
        }
        done(i + 1);
    };

    renderer.dropCaches();
    for (size_t i = 0; i < frames; ++i) {
        run.frames.push_back(
            renderShot(scene, path.shots[i], path.eye_count, options, renderer, together ? current : nullptr));
        for (uint32_t e = 0; together && e < path.eye_count; ++e)
            images[i % block * kMaxEyes + e] = current[e];
        for (size_t k = i / block * block; together && k <= i && (i + 1 == frames || (i + 1) % block == 0); ++k)
            scoreShot(k);
    }
    run.device = renderer.device();
    if (!together) {
        renderer.dropCaches();
        for (size_t i = 0; i < frames; ++i) {
            (void)renderShot(scene, path.shots[i], path.eye_count, options, renderer, images.data());
            scoreShot(i);
        }
    }
    run.accuracy = scorer.result();
    return run;
}

} // namespace gsc
