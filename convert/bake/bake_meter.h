// SPDX-License-Identifier: Apache-2.0
// All that a bake measures of a model, most of it by drawing: what a bake before has left in a file is not measured again.
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

    void letGo() const { file->letGo(file->bytes()); } // what is read of it from here on is read again
    [[nodiscard]] ChunkRead whenRead() const;

    std::shared_ptr<const GscFile> file;
    GscView view; // of the file
    std::shared_ptr<const Scene> scene;
};

class BakeMeter {
public:
    // `renderer` has loaded the model. `before`: the file that measurements are kept in, if any. Arguments passed by
    // reference must outlive this. Every function that measures throws as BakeState and as the renderer, and
    // Error(Interrupted).
    BakeMeter(const SourceModel& model, const PoseSets& poses, std::unique_ptr<Renderer> renderer,
              std::optional<BakeState> before, int threads, const BakeProgress& progress);
    BakeMeter(const BakeMeter&) = delete;
    BakeMeter& operator=(const BakeMeter&) = delete;

    // More pictures will be drawn, for a bar that knows the whole.
    void expect(size_t pictures) { m_pictures += pictures; }

    [[nodiscard]] BakeSizes sizes() const; // of the model's file
    // `sizes`: those, to be kept beside.
    [[nodiscard]] Importance weigh(const BakeSizes& sizes);
    // Draws the whole model from the poses of search and verdict, after weigh(): scores compare with these pictures.
    // Put off where a bake before has left scores.
    void drawWhole();
    // Score of `model`, baked as `plan` says, from the poses [first, first + count): poses of the search come first,
    // then those of the verdict. `model` is changed only where there is something to draw.
    [[nodiscard]] SetScore score(ReducedModel& model, const BakePlan& plan, size_t first, size_t count);
    // Score of a file from the poses of the verdict.
    [[nodiscard]] FileScore measure(const std::string& path);

    [[nodiscard]] uint64_t weightPixels() const; // of the poses of the weights
    [[nodiscard]] uint64_t drawn() const { return m_drawn; }
    [[nodiscard]] uint64_t kept() const { return uint64_t(m_kept); } // that a bake before had drawn

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
