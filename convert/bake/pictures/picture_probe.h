// SPDX-License-Identifier: Apache-2.0
// Compares pictures of a changed model with those of the whole model, from the same poses.
#pragma once

#include <gsc/camera.h>
#include <gsc/renderer.h>
#include "runtime/frames/shot.h"
#include "runtime/records/accuracy.h"
#include "runtime/records/frame_numbers.h"
#include "runtime/records/timed_details.h"

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// PSNR of one pose, dB.
struct PoseScore {
    std::string name;
    double psnr = 0; // +inf: equal
};

// PSNR of several poses, dB: of each, and over all together.
struct SetScore {
    std::vector<PoseScore> poses;
    double mse = 0; // mean over the poses
    double psnr = 0;
    size_t worst = 0; // index of the worst in `poses`

    [[nodiscard]] const PoseScore& worstPose() const { return poses[worst]; }
};

// Score of a file's pictures against the whole model's, and the time and memory of drawing them.
struct FileScore {
    Accuracy accuracy; // accuracy over the pictures of all poses, in their order
    std::string worst_pose;
    std::vector<TimedFrame> frames; // for each pose the shortest draw on the device
    uint64_t resident_bytes = 0;    // most memory of the renderer while drawing
    DeviceFacts device;             // read after the last draw
    // Milliseconds of a frame in tier `fast` for each of kTimedDetails, as if a viewer stopped at every pose: the coarse
    // copies are made before the draws are timed.
    std::array<double, std::size(kTimedDetails)> detail_ms{};
};

constexpr size_t kDrawsToMeasure = 4; // repeats of each pose: other work on the machine seldom disturbs all of them

// Draws a model and its changed versions from given poses, and compares their pictures: in tier `exact`, except frames that
// are timed with detail. Drawing throws Error as Renderer does.
class PictureProbe {
public:
    // `scene` is the whole model, which `renderer` has loaded. `told` is called after each picture, and after each pose that
    // was timed with detail.
    PictureProbe(std::shared_ptr<const Scene> scene, std::unique_ptr<Renderer> renderer, std::function<void()> told);

    // Adds poses to draw, in this order.
    void addPoses(const std::vector<Camera>& cameras);
    [[nodiscard]] const Camera& pose(size_t index) const { return m_shots[index].camera; }
    // Draws the whole model from the poses [first, first + count), unless drawn already. score() and measure() call this.
    void drawWhole(size_t first, size_t count);
    [[nodiscard]] size_t undrawn(size_t first, size_t count) const; // number of these poses without a picture yet
    // Score of `model`, drawn from the poses [first, first + count), against the whole model.
    [[nodiscard]] SetScore score(const ModelView& model, size_t first, size_t count);
    // Score of a file as by score(), with times of its frames.
    [[nodiscard]] FileScore measure(std::shared_ptr<const Scene> file, size_t first, size_t count);
    // Eye and options that a camera is drawn with.
    [[nodiscard]] EyeParams eyeOf(const Camera& camera) const;
    [[nodiscard]] FrameOptions optionsOf(const Camera& camera) const;

private:
    void draw(size_t pose, std::vector<float>& pixels);
    // Draws some columns of a picture; the others keep their pixels.
    TimedFrame drawColumns(size_t pose, const ColumnRange& columns, std::vector<float>& pixels);

    // Median frame time over the poses with one detail, milliseconds.
    double timeDetail(unsigned detail, size_t first, size_t count);
    void add(size_t pose, const std::vector<float>& pixels, size_t count, SetScore& result) const;

    std::shared_ptr<const Scene> m_scene;
    std::unique_ptr<Renderer> m_renderer;
    bool m_whole_loaded = true;
    std::function<void()> m_told;
    std::vector<Shot> m_shots;
    std::vector<std::vector<float>> m_pictures; // pictures of the whole model; empty = not drawn yet
};

} // namespace gsc
