// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/picture_probe.h"

#include "format/interrupt.h"
#include "player/cameras/scene_cameras.h"
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <cmath>

namespace gsc {

PictureProbe::PictureProbe(std::shared_ptr<const Scene> scene, int threads, std::function<void()> told)
    : m_scene(std::move(scene)), m_renderer(makeCpuRenderer(CpuPath::Fast, threads)), m_told(std::move(told))
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

void PictureProbe::draw(const Camera& camera, std::vector<float>& pixels)
{
    throwIfInterrupted();
    pixels.resize(size_t(3) * camera.width * camera.height);
    float* const image = pixels.data();
    const EyeParams eye = eyeOf(camera);
    (void)render(*m_renderer, {&eye, 1}, optionsOf(camera), &image);
    m_told();
}

void PictureProbe::addPoses(const std::vector<Camera>& cameras)
{
    m_renderer->load(m_scene);
    for (const Camera& camera : cameras) {
        m_cameras.push_back(camera);
        draw(camera, m_pictures.emplace_back());
    }
}

SetScore PictureProbe::score(const ModelView& model, size_t first, size_t count)
{
    m_renderer->load(model);
    SetScore result;
    std::vector<float> pixels;
    double worst = INFINITY;
    for (size_t i = first; i < first + count; ++i) {
        const Camera& camera = m_cameras[i];
        draw(camera, pixels);
        const ImageDifference difference = compareImages({m_pictures[i].data(), camera.width, camera.height},
                                                         {pixels.data(), camera.width, camera.height});
        result.poses.push_back({camera.name, difference.psnr});
        result.mse += difference.mse / double(count);
        if (difference.psnr < worst) {
            worst = difference.psnr;
            result.worst = i - first;
        }
    }
    result.psnr = result.mse > 0 ? -10 * std::log10(result.mse) : INFINITY;
    return result;
}

} // namespace gsc
