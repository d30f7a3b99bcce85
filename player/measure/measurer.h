// SPDX-License-Identifier: Apache-2.0
// Measures runs of many settings over many paths. Opens each backend once; draws the exact images of a path once if memory
// suffices to keep them.
#pragma once

#include "player/options/device_choice.h"
#include "player/measure/runner.h"

#include <map>
#include <memory>
#include <string>

namespace gsc {

class Measurer {
public:
    // `reference` names the backend of the exact images; empty = the measured backend. `log` must outlive this object.
    Measurer(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
             std::string reference, const ScoreOptions& score, Reporter& log);

    // The own name of a backend named as in --backend. Throws Error, as every function of this class.
    std::string nameOf(const std::string& backend);
    std::string deviceOf(const std::string& backend); // name of its device
    [[nodiscard]] std::string referenceOf(const std::string& backend) const;

    // Calls measureRun(). `path` must stay alive until a run with another path.
    RunResult run(const Path& path, const std::string& backend, const FrameOptions& frame, const FrameDone& done);

private:
    using Name = std::pair<std::string, bool>; // name of a backend; true: its second renderer, for exact images
    Renderer& renderer(const std::string& name, bool second = false);
    Renderer& reference(const std::string& name, const std::string& measured);
    ExactImages& exactImages(const Path& path, const std::string& measured, const FrameOptions& frame);

    std::shared_ptr<const Scene> m_scene;
    ModelChoice m_model;
    DeviceChoice m_choice;
    std::string m_reference, m_measured; // backends; m_measured: backend that "auto" chose
    ScoreOptions m_score;
    Reporter& m_log;
    std::map<Name, std::unique_ptr<Renderer>> m_renderers;

    // the exact images in memory, with their path, the backend that draws them and the backend that they are compared with
    const Path* m_exact_path = nullptr;
    std::string m_exact_reference, m_exact_measured;
    std::unique_ptr<ExactImages> m_exact;
};

} // namespace gsc
