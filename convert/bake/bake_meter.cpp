// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/bake_meter.h"

#include <gsc/interrupt.h>
#include <gsc/renderer.h>
#include "runtime/records/timed_details.h"

#include <algorithm>
#include <iterator>

namespace gsc {

SourceModel::SourceModel(const BakeOptions& options)
    : file(std::make_shared<const GscFile>(options.input, throwFirstIssue(options.name), GscFile::Read::All,
                                           options.threads))
{
    openGsc(file->bytes(), view, GscCheck::Full, throwFirstIssue(options.name));
    scene = Scene::open(file, options.name);
    letGo();
}

ChunkRead SourceModel::whenRead() const
{
    return [this](uint32_t chunk) { file->letGo(chunkPayload(view, view.chunks[chunk])); };
}

BakeMeter::BakeMeter(const SourceModel& model, const PoseSets& poses, std::unique_ptr<Renderer> renderer,
                     std::optional<BakeState> before, int threads, const BakeProgress& progress)
    : m_model(model), m_poses(poses), m_threads(threads), m_progress(progress), m_before(std::move(before)),
      m_probe(m_model.scene, std::move(renderer), [this] { tell(); })
{
}

BakeSizes BakeMeter::sizes() const
{
    if (m_before && m_before->poses() > 0)
        return m_before->before();
    return {m_model.file->bytes().size(), archiveSize(*m_model.file, m_model.view, m_threads)};
}

Importance BakeMeter::weigh(const BakeSizes& sizes)
{
    ImportanceMeter meter(m_model.scene->view(), m_threads, m_model.whenRead());
    size_t done = 0;
    if (m_before && m_before->poses() > 0) {
        m_before->read(meter.found());
        done = m_before->poses();
        keep(int64_t(done));
    }
    for (; done < m_poses.weights.size(); ++done) {
        const Camera& camera = m_poses.weights[done];
        if (m_before && done > m_before->poses() && (interrupted() || m_before->isDue(meter.found())))
            m_before->write(sizes, meter.found());
        throwIfInterrupted();
        const EyeParams eye = m_probe.eyeOf(camera);
        const FrameOptions options = m_probe.optionsOf(camera);
        meter.add(eye, options);
        meter.lookFrom(eye.center, options.appearance);
        tell();
    }
    if (m_before && done > m_before->poses())
        m_before->write(sizes, meter.found());
    return std::move(meter).take();
}

void BakeMeter::drawWhole()
{
    m_probe.addPoses(m_poses.search);
    m_probe.addPoses(m_poses.verdict);
    const size_t count = m_poses.search.size() + m_poses.verdict.size();
    if (m_before && m_before->hasScores())
        // score() draws them if it is asked for a score that is not in the file
        keep(int64_t(count));
    else
        m_probe.drawWhole(0, count);
}

SetScore BakeMeter::score(ReducedModel& model, const BakePlan& plan, size_t first, size_t count)
{
    if (m_before)
        if (std::optional<SetScore> known = m_before->take(plan, first, count)) {
            for (size_t i = 0; i < count; ++i)
                known->poses[i].name = m_probe.pose(first + i).name;
            keep(int64_t(count));
            return *std::move(known);
        }
    drawAgain(first, count);
    model.apply(plan);
    SetScore score = m_probe.score(model.view(), first, count);
    if (m_before)
        m_before->add(plan, first, count, score);
    return score;
}

FileScore BakeMeter::measure(const std::string& path)
{
    const size_t first = m_poses.search.size(), count = m_poses.verdict.size();
    expect((kDrawsToMeasure + std::size(kTimedDetails)) * count);
    drawAgain(first, count);
    return m_probe.measure(Scene::open(path), first, count);
}

uint64_t BakeMeter::weightPixels() const
{
    uint64_t pixels = 0;
    for (const Camera& camera : m_poses.weights)
        pixels += uint64_t(camera.width) * camera.height;
    return pixels;
}

// Counts one picture as drawn, and reports progress.
void BakeMeter::tell()
{
    m_model.letGo();
    ++m_drawn;
    showProgress();
}

void BakeMeter::keep(int64_t pictures)
{
    m_kept += pictures;
    showProgress();
}

// Corrects the counts: pictures of the whole model that drawWhole() postponed were counted as kept, but those of these
// poses are drawn now.
void BakeMeter::drawAgain(size_t first, size_t count)
{
    m_kept -= int64_t(m_probe.undrawn(first, count));
}

void BakeMeter::showProgress() const
{
    if (m_progress)
        m_progress("bake", std::min(m_drawn + uint64_t(m_kept), m_pictures), m_pictures);
}

} // namespace gsc
