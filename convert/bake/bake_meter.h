// SPDX-License-Identifier: Apache-2.0
// All measurements of a bake, most of them by drawing. Measurements in the file of a stopped bake are not made again.
#pragma once

#include "convert/bake/bake.h"
#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"
#include "convert/bake/pictures/pose_sets.h"
#include "convert/bake/state/bake_state.h"
#include "convert/bake/weights/importance.h"
#include <gsc/gsc_file.h>
#include <gsc/gsc_reader.h>
#include <gsc/scene.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace gsc {

// The model that is baked.
struct SourceModel {
    explicit SourceModel(const BakeOptions& options);
    SourceModel(const SourceModel&) = delete;
    SourceModel& operator=(const SourceModel&) = delete;

    // frees the pages in memory: later reads fetch them from the file again
    void letGo() const { file->letGo(file->bytes()); }
    [[nodiscard]] ChunkRead whenRead() const;

    std::shared_ptr<const GscFile> file;
    GscView view; // view of the file
    std::shared_ptr<const Scene> scene;
};

class BakeMeter {
public:
    // `renderer` has loaded the model. `before`: file that keeps measurements, if any. Arguments passed by reference must
    // outlive this. Every function that measures throws as BakeState and as the renderer, and Error(Interrupted).
    BakeMeter(const SourceModel& model, const PoseSets& poses, std::unique_ptr<Renderer> renderer,
              std::optional<BakeState> before, int threads, const BakeProgress& progress);
    BakeMeter(const BakeMeter&) = delete;
    BakeMeter& operator=(const BakeMeter&) = delete;

    // Announces pictures that will be drawn, for the total of the progress.
    void expect(size_t pictures) { m_pictures += pictures; }

    [[nodiscard]] BakeSizes sizes() const; // sizes of the model's file
    // Measures importance. `sizes`: result of sizes(), kept in the same file.
    [[nodiscard]] Importance weigh(const BakeSizes& sizes);
    // Draws the whole model from the poses of search and verdict, after weigh(): scores compare with these pictures.
    // Postponed while the file still has scores.
    void drawWhole();
    // Score of `model`, baked as `plan` says, from the poses [first, first + count): poses of the search come first,
    // then those of the verdict. Changes `model` only if the score has to be drawn.
    [[nodiscard]] SetScore score(ReducedModel& model, const BakePlan& plan, size_t first, size_t count);
    // Score of a file from the poses of the verdict.
    [[nodiscard]] FileScore measure(const std::string& path);

    [[nodiscard]] uint64_t weightPixels() const; // pixels of all poses for weights
    [[nodiscard]] uint64_t drawn() const { return m_drawn; }
    [[nodiscard]] uint64_t kept() const { return uint64_t(m_kept); } // pictures taken from the state file, not drawn

private:
    void tell();
    void keep(int64_t pictures);
    void drawAgain(size_t first, size_t count);
    void showProgress() const;

    const SourceModel& m_model;
    const PoseSets& m_poses;
    const int m_threads;
    const BakeProgress& m_progress;
    std::optional<BakeState> m_before;
    PictureProbe m_probe;
    uint64_t m_drawn = 0, m_pictures = 0;
    int64_t m_kept = 0;
};

} // namespace gsc
