// SPDX-License-Identifier: Apache-2.0
// Pictures of a changed model held against those of the whole one, from the same poses.
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

// Pictures of a file against those of the whole model, and what drawing them took.
struct FileScore {
    Accuracy accuracy; // of the poses, in their order
    std::string worst_pose;
    std::vector<TimedFrame> frames; // of each pose the draw that took least on the device
    uint64_t resident_bytes = 0;    // most that the renderer had in them
    DeviceFacts device;             // asked for after the last of them
    // Milliseconds in tier `fast`, one of kTimedDetails each, of a viewer who stops at every pose: the coarse copies that it
    // needs are made before its draws are timed.
    std::array<double, std::size(kTimedDetails)> detail_ms{};
};

constexpr size_t kDrawsToMeasure = 4; // of each pose: what else the machine does is seldom in all of them

// Draws in tier `exact`, but for what is timed with detail.
class PictureProbe {
public:
    // `scene` is the whole model, which `renderer` has loaded. `told` is called after each picture, and after each pose that
    // was timed with detail.
    PictureProbe(std::shared_ptr<const Scene> scene, std::unique_ptr<Renderer> renderer, std::function<void()> told);

    // Poses that scores are of, in this order.
    void addPoses(const std::vector<Camera>& cameras);
    [[nodiscard]] const Camera& pose(size_t index) const { return m_shots[index].camera; }
    // Draws the whole model from the poses [first, first + count), unless that is done. score() and measure() do so
    // too.
    void drawWhole(size_t first, size_t count);
    [[nodiscard]] size_t undrawn(size_t first, size_t count) const; // of those
    // Score of `model`, drawn from the poses [first, first + count), against the whole model.
    [[nodiscard]] SetScore score(const ModelView& model, size_t first, size_t count);
    // Score of a file as by score(), with times of its frames.
    [[nodiscard]] FileScore measure(std::shared_ptr<const Scene> file, size_t first, size_t count);
    // As an eye of a frame, with the options it is drawn with.
    [[nodiscard]] EyeParams eyeOf(const Camera& camera) const;
    [[nodiscard]] FrameOptions optionsOf(const Camera& camera) const;

private:
    void draw(size_t pose, std::vector<float>& pixels);
    // Some columns of a picture; the others stay as they were.
    TimedFrame drawColumns(size_t pose, const ColumnRange& columns, std::vector<float>& pixels);

    // Medians over the poses with one detail, in milliseconds.
    double timeDetail(unsigned detail, size_t first, size_t count);
    void add(size_t pose, const std::vector<float>& pixels, size_t count, SetScore& result) const;

    std::shared_ptr<const Scene> m_scene;
    std::unique_ptr<Renderer> m_renderer;
    bool m_whole_loaded = true;
    std::function<void()> m_told;
    std::vector<Shot> m_shots;
    std::vector<std::vector<float>> m_pictures; // of the whole model; empty = undrawn
};

} // namespace gsc
