// SPDX-License-Identifier: Apache-2.0
// The neutral model every checkpoint reader produces and everything in convert/ consumes.
#pragma once

#include "convert/input/torch/mlp.h"
#include "runtime/cameras/length.h"
#include <gsc/source_camera.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gsc {

// Everything of a checkpoint but its anchors. Scalars a checkpoint does not hold are filled as upstream's
// loader would fill them.
struct Checkpoint {
    std::string model_path;                // as the user named it
    std::string ply_path;                  // the PLY that is read
    std::vector<std::string> weight_paths; // files the MLPs came from, in the order they were read
    std::string cfg_args;                  // text of cfg_args or config.yaml, empty if absent
    std::string container;                 // "split" (.pt files), "unite" (checkpoints.pth) or "v1" (checkpoint.pth)
    std::vector<std::string> warnings;     // facts the user should know, one sentence each
    int iteration = -1;                    // n of point_cloud/iteration_<n>, -1 if the folder has no such name

    ModelFamily family{};
    uint64_t anchor_count = 0;
    uint32_t feat_dim = 0, n_offsets = 0, appearance_dim = 0;
    uint32_t flags = 0; // ModelFlags, without the HasRotation/HasOpacity/HasNormal bits
    LevelRule level_rule = LevelRule::None;
    RasterRules raster_rules = RasterRules::DiffGaussian;
    uint32_t fork = 2;
    int32_t level_min = 0, level_clamp = 0;
    float standard_dist = 0;
    float voxel_size = 0;         // level 0, as stored by the trainer; 0 = not stored
    std::vector<Mlp> mlps;        // opacity, covariance, colour, [feature bank]
    std::vector<float> embedding; // rows x appearance_dim
    // Numbers of those rows, ascending, where some are not there; empty = all from 0 on.
    std::vector<uint32_t> embedding_numbers;
    std::vector<SourceCamera> cameras;
    Metre metre; // stated by metre.json or by the file; units 0 = to be derived

    [[nodiscard]] uint32_t embeddingRows() const
    {
        return appearance_dim != 0 ? uint32_t(embedding.size() / appearance_dim) : 0;
    }
};

// Anchors of consecutive PLY rows. Each vector holds count times the stated number of values.
struct AnchorBatch {
    uint64_t first = 0; // source index of the first
    size_t count = 0;
    std::vector<float> position;    // 3
    std::vector<int32_t> level;     // 1; zero for Scaffold-GS
    std::vector<float> extra_level; // 1; zero for Scaffold-GS
    std::vector<float> offset;      // K x 3, k-major (the PLY is axis-major)
    std::vector<float> feature;     // F
    std::vector<float> scale;       // 6, natural logs
    std::vector<float> rotation;    // 4 (w, x, y, z)
    std::vector<float> opacity;     // 1; logit(0.1) where the file has no such column
    std::vector<float> normal;      // 3; zero where the file has no such columns
};

enum AnchorFields : uint32_t {
    kAnchorPlacement = 1, // position, level, extra_level
    kAnchorAll = ~0u,
};

// Sequential reader of the anchors; memory is bounded by the batch, whatever the size of the file.
class AnchorSource {
public:
    virtual ~AnchorSource() = default;
    // Fills `batch` with the next rows (at most max_rows); false at the end. `fields` (AnchorFields) that are not asked
    // for are left empty. Throws Error (Io, InvalidFile).
    virtual bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) = 0;
    virtual void rewind() = 0;
};

struct CheckpointOptions {
    std::string scene_dir; // --scene-dir: folder that holds cameras.json, transforms*.json or cfg_args; may be empty
    int iteration = -1;    // --iteration; -1 = the largest
    int level_rule = -1;   // --dist2level: a LevelRule, for models without cfg_args
    int add_level = -1;    // --add-level 0|1 for models without cfg_args
    int fork = 0;          // --fork, 0 = from cfg_args or 2
};

// Reads everything but the anchors of the model in `path`: a model folder, a point_cloud/iteration_<n> folder or the
// PLY itself. Content decides of which kind the model is (format facts 1.3).
// Throws Error: Io (missing or unreadable file), InvalidFile (damaged or inconsistent), Unsupported (a family that
// cannot be represented exactly; the message names what was found and what to do), Usage (an option that contradicts
// the model).
Checkpoint readCheckpoint(const std::string& path, const CheckpointOptions& options);

// The anchors of a checkpoint that readCheckpoint returned, in PLY order.
std::unique_ptr<AnchorSource> openAnchors(const Checkpoint& checkpoint);

} // namespace gsc
