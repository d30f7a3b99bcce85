// SPDX-License-Identifier: Apache-2.0
// Measures runs of many settings over many paths. Opens each backend once; draws the exact images of a path once if memory
// suffices to keep them.
#pragma once

#include "player/options/device_choice.h"
#include "player/measure/runner.h"

#include <map>
#include <memory>
#include <span>
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

    struct Planned {
        const Path* path; // must stay alive until a run with another path
        std::string backend;
    };
    // Calls measureRun() for the first of `planned`, and shows progress; the others are the runs that are to follow.
    RunResult run(std::span<const Planned> planned, const FrameOptions& frame);

private:
    using Name = std::pair<std::string, bool>; // name of a backend; true: its second renderer, for exact images
    Renderer& renderer(const std::string& name, bool second = false);
    Renderer& reference(const std::string& name, const std::string& measured);
    // Path of exact images, backend that draws them and backend that they are compared with.
    struct ExactOf {
        const Path* path = nullptr;
        std::string reference, measured;
        bool operator==(const ExactOf&) const = default;
    };
    [[nodiscard]] ExactOf exactOf(const Planned& run) const
    {
        return {run.path, referenceOf(run.backend), run.backend};
    }
    ExactImages& exactImages(const ExactOf& of, const FrameOptions& frame, const StepDone& done);
    [[nodiscard]] uint64_t stepsOf(std::span<const Planned> runs) const;

    std::shared_ptr<const Scene> m_scene;
    ModelChoice m_model;
    DeviceChoice m_choice;
    std::string m_reference, m_measured; // backends; m_measured: backend that "auto" chose
    ScoreOptions m_score;
    Reporter& m_log;
    std::map<Name, std::unique_ptr<Renderer>> m_renderers;

    ExactOf m_exact_of;
    std::unique_ptr<ExactImages> m_exact; // those in memory
    uint64_t m_steps = 0;                 // steps of all runs so far
};

} // namespace gsc
