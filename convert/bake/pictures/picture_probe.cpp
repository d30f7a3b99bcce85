// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/pictures/picture_probe.h"

#include "convert/bake/weights/picture_bands.h"
#include "runtime/frames/frame_loop.h"
#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// Most frames until all coarse copies are made, and frames in a row without a new copy that tell it. A GPU makes part of the
// copies in each frame, and none in a frame that has to free memory first; if copies exceed its memory it never stops.
constexpr size_t kMostDrawsToMake = 16, kDrawsWithoutMakes = 2;

// The least time of each stage: what else the machine does is seldom in all draws.
void keepLeast(TimedFrame& least, const TimedFrame& drawn)
{
    const auto keep = [&](double StageTimes::*stage) {
        least.result.times.*stage = std::min(least.result.times.*stage, drawn.result.times.*stage);
    };
    for (const auto& stage : kStages)
        keep(stage.field);
    keep(&StageTimes::total);
    least.wall_ms = std::min(least.wall_ms, drawn.wall_ms);
}

// The score of pictures that have a pixel that is no number is as bad as can be.
double orWorst(double score, double worst)
{
    return std::isnan(score) ? worst : score;
}

} // namespace

PictureProbe::PictureProbe(std::shared_ptr<const Scene> scene, std::unique_ptr<Renderer> renderer,
                           std::function<void()> told)
    : m_scene(std::move(scene)), m_renderer(std::move(renderer)), m_told(std::move(told))
{
}

EyeParams PictureProbe::eyeOf(const Camera& camera) const
{
    return eyeParams(camera, m_scene->view().origin);
}

FrameOptions PictureProbe::optionsOf(const Camera& camera) const
{
    return exactOptionsFor(*m_scene, camera);
}

void PictureProbe::draw(size_t pose, std::vector<float>& pixels)
{
    // bands on the host only: a device has memory for all slots. At most half of the slots of a city are visible
    const uint64_t slots = m_scene->anchorCount() * m_scene->view().params->n_offsets / 2;
    for (const ColumnRange& columns : pictureBands(m_shots[pose].camera.width, m_renderer->onHost() ? slots : 0))
        (void)drawColumns(pose, columns, pixels);
    m_told();
}

TimedFrame PictureProbe::drawColumns(size_t pose, const ColumnRange& columns, std::vector<float>& pixels)
{
    pixels.resize(size_t(3) * m_shots[pose].camera.width * m_shots[pose].camera.height);
    FrameLoop loop(*m_scene, m_shots, 1, exactOptions(modelOptions(*m_scene)), *m_renderer);
    const auto into = [&](size_t, LoopFrame& frame) {
        frame.options.columns = columns;
        frame.targets[0] = hostTarget(pixels.data());
        frame.delivers = true;
    };
    return loop.draw(pose, into);
}

void PictureProbe::addPoses(const std::vector<Camera>& cameras)
{
    for (const Camera& camera : cameras)
        m_shots.push_back(shotOf(*m_scene, camera));
    m_pictures.resize(m_shots.size());
}

size_t PictureProbe::undrawn(size_t first, size_t count) const
{
    return size_t(std::count_if(m_pictures.begin() + ptrdiff_t(first), m_pictures.begin() + ptrdiff_t(first + count),
                                [](const std::vector<float>& picture) { return picture.empty(); }));
}

void PictureProbe::drawWhole(size_t first, size_t count)
{
    for (size_t i = first; i < first + count; ++i) {
        if (!m_pictures[i].empty())
            continue;
        if (!m_whole_loaded)
            m_renderer->load(m_scene);
        m_whole_loaded = true;
        std::vector<float> pixels;
        draw(i, pixels);
        m_pictures[i] = std::move(pixels);
    }
}

SetScore PictureProbe::score(const ModelView& model, size_t first, size_t count)
{
    drawWhole(first, count);
    m_whole_loaded = false;
    m_renderer->load(model);
    SetScore result;
    std::vector<float> pixels;
    for (size_t i = first; i < first + count; ++i) {
        draw(i, pixels);
        add(i, pixels, count, result);
    }
    return result;
}

// Adds the score of one of `count` poses to `result`.
void PictureProbe::add(size_t pose, const std::vector<float>& pixels, size_t count, SetScore& result) const
{
    const Camera& camera = m_shots[pose].camera;
    const ImageDifference difference = compareImages({m_pictures[pose].data(), camera.width, camera.height},
                                                     {pixels.data(), camera.width, camera.height});
    result.poses.push_back({camera.name, difference.psnr});
    result.mse += difference.mse / double(count);
    if (difference.psnr < result.worstPose().psnr)
        result.worst = result.poses.size() - 1;
    result.psnr = psnrOf(result.mse);
}

FileScore PictureProbe::measure(std::shared_ptr<const Scene> file, size_t first, size_t count)
{
    drawWhole(first, count);
    m_whole_loaded = false;
    m_renderer->load(std::move(file));
    FileScore result;
    Accuracy& accuracy = result.accuracy;
    accuracy.images = accuracy.ssim.frames = accuracy.flip.frames = count;
    accuracy.psnr_min = INFINITY;
    accuracy.ssim.worst = 1;
    double mse = 0;
    std::vector<float> pixels;
    for (size_t i = first; i < first + count; ++i) {
        TimedFrame least;
        for (size_t turn = 0; turn < kDrawsToMeasure; ++turn) {
            const TimedFrame drawn = drawColumns(i, {}, pixels);
            m_told();
            result.resident_bytes = std::max(result.resident_bytes, drawn.result.bytes_resident);
            if (turn == 0)
                least = drawn;
            keepLeast(least, drawn);
        }
        result.frames.push_back(least);
        const Camera& camera = m_shots[i].camera;
        const ImageView whole{m_pictures[i].data(), camera.width, camera.height};
        const ImageView now{pixels.data(), whole.width, whole.height};
        const ImageDifference difference = compareImages(whole, now);
        mse += difference.mse / double(count);
        if (i == first || difference.psnr < accuracy.psnr_min) {
            accuracy.psnr_min = difference.psnr;
            accuracy.psnr_min_frame = i - first;
            result.worst_pose = camera.name;
        }
        accuracy.max_error = std::max(accuracy.max_error, difference.max_error);
        accuracy.over_1_255 += difference.over_1_255;
        accuracy.frame_psnr.push_back(difference.psnr);
        accuracy.frame_temporal.push_back(NAN);
        const double likeness = orWorst(ssim(whole, now), 0), error = orWorst(flip(whole, now), 1);
        accuracy.ssim.mean += likeness / double(count);
        accuracy.flip.mean += error / double(count);
        accuracy.ssim.worst = std::min(accuracy.ssim.worst, likeness);
        accuracy.flip.worst = std::max(accuracy.flip.worst, error);
    }
    std::vector<double> sorted = accuracy.frame_psnr;
    std::ranges::sort(sorted);
    accuracy.psnr_pooled = psnrOf(mse);
    accuracy.psnr_p1 = nearestRank(sorted, 0.01);
    result.device = m_renderer->device();
    for (size_t i = 0; i < std::size(kTimedDetails); ++i)
        result.detail_ms[i] = timeDetail(kTimedDetails[i], first, count);
    return result;
}

double PictureProbe::timeDetail(unsigned detail, size_t first, size_t count)
{
    FrameOptions options = modelOptions(*m_scene);
    options.tier = Tier::Fast;
    options.detail = float(detail);
    FrameLoop loop(*m_scene, m_shots, 1, options, *m_renderer);
    m_renderer->dropCaches();
    std::vector<double> frames;
    for (size_t i = first; i < first + count; ++i) {
        for (size_t turn = 0, without = 0; turn < kMostDrawsToMake && without < kDrawsWithoutMakes; ++turn)
            without = loop.draw(i, {}).result.coarse.made == 0 ? without + 1 : 0;
        frames.push_back(INFINITY);
        for (size_t turn = 0; turn < kDrawsToMeasure; ++turn)
            frames.back() = std::min(frames.back(), loop.draw(i, {}).result.times.total);
        m_told();
    }
    return spreadOf(std::move(frames)).median;
}

} // namespace gsc
