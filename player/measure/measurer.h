// SPDX-License-Identifier: Apache-2.0
// Runs of many combinations over many paths: opens each backend once and renders the exact images of a path once where it
// can keep them.
#pragma once

#include "player/options/device_choice.h"
#include "player/measure/runner.h"

#include <map>
#include <memory>
#include <string>

namespace gsc {

class Measurer {
public:
    // `reference` names the backend of the exact images; empty = the one that is measured. All must outlive this.
    Measurer(std::shared_ptr<const Scene> scene, const ModelChoice& model, const DeviceChoice& choice,
             std::string reference, const ScoreOptions& score, Reporter& log);

    // The backend's own name for one of --backend. Throws Error, as all do.
    std::string nameOf(const std::string& backend);
    std::string deviceOf(const std::string& backend); // its device's
    [[nodiscard]] std::string referenceOf(const std::string& backend) const;

    // measureRun() with what it needs. `path` must stay until a run with another one.
    RunResult run(const Path& path, const std::string& backend, const FrameOptions& frame, const FrameDone& done);

private:
    using Name = std::pair<std::string, bool>; // of a backend; a second one renders exact images
    Renderer& renderer(const std::string& name, bool second = false);
    Renderer& reference(const std::string& name, const std::string& measured);
    ExactImages& exactImages(const Path& path, const std::string& measured, const FrameOptions& frame);

    std::shared_ptr<const Scene> m_scene;
    ModelChoice m_model;
    DeviceChoice m_choice;
    std::string m_reference, m_measured; // backends; m_measured: of "auto"
    ScoreOptions m_score;
    Reporter& m_log;
    std::map<Name, std::unique_ptr<Renderer>> m_renderers;

    // the images at hand, and of what and for what they are
    const Path* m_exact_path = nullptr;
    std::string m_exact_reference, m_exact_measured;
    std::unique_ptr<ExactImages> m_exact;
};

} // namespace gsc
