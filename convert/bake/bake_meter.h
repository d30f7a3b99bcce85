// SPDX-License-Identifier: Apache-2.0
// Makes the measurements of a bake, most of them by drawing pictures. A measurement that the file of a stopped bake
// holds is not made again.
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

// The model that is baked: its file, the view of it, and the scene.
struct SourceModel {
    explicit SourceModel(const BakeOptions& options);
    SourceModel(const SourceModel&) = delete;
    SourceModel& operator=(const SourceModel&) = delete;

    // frees the memory of the file's pages; later reads fetch them from the disk again
    void letGo() const { file->letGo(file->bytes()); }
    [[nodiscard]] ChunkRead whenRead() const;

    std::shared_ptr<const GscFile> file;
    GscView view; // view of `file`
    std::shared_ptr<const Scene> scene;
};

class BakeMeter {
public:
    // `renderer` must have loaded the model. `before`: file with measurements of a stopped bake, if any. Arguments
    // passed by reference must outlive this. Functions that measure throw as BakeState and the renderer do, and
    // Error(Interrupted).
    BakeMeter(const SourceModel& model, const PoseSets& poses, std::unique_ptr<Renderer> renderer,
              std::optional<BakeState> before, int threads, const BakeProgress& progress);
    BakeMeter(const BakeMeter&) = delete;
    BakeMeter& operator=(const BakeMeter&) = delete;

    // Adds the number of pictures that will be drawn to the total of the progress.
    void expect(size_t pictures) { m_pictures += pictures; }

    [[nodiscard]] BakeSizes sizes() const; // sizes of the model's file and of its archive
    // Measures the importance of every slot. `sizes`: result of sizes(), which is kept in the same file as the
    // importance.
    [[nodiscard]] Importance weigh(const BakeSizes& sizes);
    // Draws the whole model from the poses of search and verdict, to compare with for scores. Call after weigh(). If
    // the file of a stopped bake still has scores, the pictures are drawn only when needed.
    void drawWhole();
    // Scores `model` after the changes of `plan`, from `count` poses beginning with number `first`; poses of the search
    // come before those of the verdict. Changes `model` only if pictures have to be drawn.
    [[nodiscard]] SetScore score(ReducedModel& model, const BakePlan& plan, size_t first, size_t count);
    // Scores the pictures of a file from the poses of the verdict.
    [[nodiscard]] FileScore measure(const std::string& path);

    [[nodiscard]] uint64_t weightPixels() const; // pixels of all poses of the set `weights` together
    [[nodiscard]] uint64_t drawn() const { return m_drawn; }
    // pictures whose scores came from the file of a stopped bake
    [[nodiscard]] uint64_t kept() const { return uint64_t(m_kept); }

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
