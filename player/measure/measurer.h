// SPDX-License-Identifier: Apache-2.0
// Runs of many combinations over many paths: opens each backend once and renders the exact images of a path once.
#pragma once

#include "player/measure/runner.h"

#include <map>
#include <memory>
#include <string>

namespace gsc {

class Measurer {
public:
    // `reference` names the backend of the exact images; empty = the one that is measured. All must outlive this.
    Measurer(std::shared_ptr<const Scene> scene, const PlayOptions& options, std::string reference, Reporter& log);

    // The backend's own name for one of --backend. Throws Error, as all do.
    std::string nameOf(const std::string& backend);
    std::string deviceOf(const std::string& backend); // its device's
    [[nodiscard]] std::string referenceOf(const std::string& backend) const;

    // measureRun() with what it needs. `path` must stay until a run with another one.
    RunResult run(const Path& path, const std::string& backend, const FrameOptions& frame, const ScoreOptions& score,
                  const FrameDone& done);

private:
    Renderer& renderer(const std::string& name, bool second = false);
    ExactImages& exactImages(const Path& path, const std::string& reference, const FrameOptions& frame);

    std::shared_ptr<const Scene> m_scene;
    PlayOptions m_options;
    std::string m_reference, m_measured; // backends; m_measured: of "auto"
    Reporter& m_log;
    // a second one of a name renders exact images between the frames of the first
    std::map<std::pair<std::string, bool>, std::unique_ptr<Renderer>> m_renderers;

    // the images at hand, and of what they are
    const Path* m_exact_path = nullptr;
    std::string m_exact_reference;
    std::unique_ptr<ExactImages> m_exact;
};

} // namespace gsc
