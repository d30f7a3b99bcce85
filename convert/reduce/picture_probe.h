// SPDX-License-Identifier: Apache-2.0
// Pictures of a changed model held against those of the whole one, from the same poses.
#pragma once

#include "runtime/camera.h"
#include "runtime/renderer.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

struct PoseScore {
    std::string name;
    double psnr = 0; // +inf: equal
};

struct SetScore {
    std::vector<PoseScore> poses;
    double mse = 0; // mean of the poses'
    double psnr = 0;
    size_t worst = 0; // of `poses`

    [[nodiscard]] const PoseScore& worstPose() const { return poses[worst]; }
};

// Draws in tier `exact` on the CPU.
class PictureProbe {
public:
    // `told` is called after each picture. `scene` is the whole model.
    PictureProbe(std::shared_ptr<const Scene> scene, int threads, std::function<void()> told);

    void addPoses(const std::vector<Camera>& cameras); // draws what they are held against
    // Of the poses [first, first + count).
    [[nodiscard]] SetScore score(const ModelView& model, size_t first, size_t count);
    // As an eye of a frame, with the options it is drawn with.
    [[nodiscard]] EyeParams eyeOf(const Camera& camera) const;
    [[nodiscard]] FrameOptions optionsOf(const Camera& camera) const;

private:
    void draw(const Camera& camera, std::vector<float>& pixels);

    std::shared_ptr<const Scene> m_scene;
    std::unique_ptr<Renderer> m_renderer;
    std::function<void()> m_told;
    std::vector<Camera> m_cameras;
    std::vector<std::vector<float>> m_pictures; // of the whole model
};

} // namespace gsc
