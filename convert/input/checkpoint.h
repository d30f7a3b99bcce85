// SPDX-License-Identifier: Apache-2.0
// The checkpoint as one structure, whatever its format: every reader of checkpoints fills it, and the rest of convert/
// uses it.
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

// Everything of a checkpoint except its anchors. A number that the checkpoint does not hold gets the default of the
// trainer's loader.
struct Checkpoint {
    std::string model_path;                // path of the model as the user gave it
    std::string ply_path;                  // path of the PLY that is read
    std::vector<std::string> weight_paths; // files that the MLPs were read from, in the order of reading
    std::string cfg_args;                  // text of cfg_args or config.yaml, empty if absent
    std::string container;                 // "split" (.pt files), "unite" (checkpoints.pth) or "v1" (checkpoint.pth)
    std::vector<std::string> warnings;     // facts the user should know, one sentence each
    int iteration = -1; // n of the folder point_cloud/iteration_<n>; -1 if the folder has another name

    ModelFamily family{};
    uint64_t anchor_count = 0;
    uint32_t feat_dim = 0, n_offsets = 0, appearance_dim = 0;
    uint32_t flags = 0; // ModelFlags, except HasRotation, HasOpacity and HasNormal, which are found in the anchors
    LevelRule level_rule = LevelRule::None;
    RasterRules raster_rules = RasterRules::DiffGaussian;
    uint32_t fork = 2;
    int32_t level_min = 0, level_clamp = 0;
    float standard_dist = 0;
    // edge of a voxel of level 0 in world units, as the trainer stored it; 0 = not stored
    float voxel_size = 0;
    std::vector<Mlp> mlps; // in this order: opacity, covariance, colour, and the feature bank if the model has one
    std::vector<float> embedding; // appearance embedding: rows x appearance_dim values
    // If rows of the embedding are missing: the numbers of the rows that are there, ascending. Empty = all rows are
    // there, from 0 on.
    std::vector<uint32_t> embedding_numbers;
    std::vector<SourceCamera> cameras;
    // stated by metre.json or by a .gsc file; its `units` is 0 if it has to be derived from the model
    Metre metre;

    [[nodiscard]] uint32_t embeddingRows() const
    {
        return appearance_dim != 0 ? uint32_t(embedding.size() / appearance_dim) : 0;
    }
};

// Anchors of consecutive rows of the PLY. Each vector holds `count` times as many values as its comment says.
struct AnchorBatch {
    uint64_t first = 0; // row number in the PLY of the first anchor
    size_t count = 0;
    std::vector<float> position;    // 3 values per anchor: x, y, z
    std::vector<int32_t> level;     // 1 value per anchor; 0 for Scaffold-GS
    std::vector<float> extra_level; // 1 value per anchor; 0 for Scaffold-GS
    std::vector<float> offset;      // K x 3 values per anchor, index 3 k + axis
    std::vector<float> feature;     // feat_dim values per anchor
    std::vector<float> scale;       // 6 values per anchor, natural logarithms
    std::vector<float> rotation;    // 4 values per anchor: quaternion (w, x, y, z)
    std::vector<float> opacity;     // 1 value per anchor; logit(0.1) if the file has no such column
    std::vector<float> normal;      // 3 values per anchor; 0 if the file has no such columns
};

enum AnchorFields : uint32_t {
    kAnchorPlacement = 1, // the arrays position, level and extra_level
    kAnchorAll = ~0u,
};

// Reads the anchors from first to last. Memory depends on the size of a batch, not on that of the file.
class AnchorSource {
public:
    virtual ~AnchorSource() = default;
    // Fills `batch` with the next anchors, at most max_rows; returns false when none is left. Only the arrays named in
    // `fields` (AnchorFields) are filled, the others are empty. Throws Error (Io, InvalidFile).
    virtual bool next(AnchorBatch& batch, uint32_t fields, size_t max_rows) = 0;
    virtual void rewind() = 0;
};

struct CheckpointOptions {
    std::string scene_dir; // --scene-dir: folder with cameras.json, transforms*.json or cfg_args; may be empty
    int iteration = -1;    // --iteration; -1 = the highest there is
    int level_rule = -1;   // --dist2level: a LevelRule for models without cfg_args; -1 = not given
    int add_level = -1;    // --add-level: 0 or 1 for models without cfg_args; -1 = not given
    int fork = 0;          // --fork; 0 = as in cfg_args, or 2 without one
};

// Reads a checkpoint, except its anchors. `path` is a model folder, a point_cloud/iteration_<n> folder or the PLY
// itself. The content of the files decides which trainer wrote the model. Throws Error: Io (missing or unreadable
// file), InvalidFile (damaged or inconsistent), Unsupported (a kind of model that cannot be represented exactly; the
// message names what was found and what to do), Usage (an option that contradicts the model).
Checkpoint readCheckpoint(const std::string& path, const CheckpointOptions& options);

// Opens the anchors of a checkpoint that readCheckpoint() returned, to be read in the order of the PLY.
std::unique_ptr<AnchorSource> openAnchors(const Checkpoint& checkpoint);

} // namespace gsc
