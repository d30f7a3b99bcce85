// SPDX-License-Identifier: Apache-2.0
// The text files beside a model: PLY header, cfg_args, cameras.json, trajectory.
#pragma once

#include <gsc/source_camera.h>

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

std::string plyHeader(uint64_t anchors, bool octree, uint32_t feat_dim, uint32_t n_offsets);

// Values that differ between sample models; all others are those of training with the shipped scripts.
struct TrainingArguments {
    std::string scene; // last part of source_path and model_path
    bool everything_on = false;
    uint32_t appearance_dim = 0;
    double voxel_size = 0; // Scaffold-GS
    int base_layer = 0;    // Octree-GS
};

std::string scaffoldArguments(const TrainingArguments& arguments);
std::string octreeArguments(const TrainingArguments& arguments);

// Upstream's order and keys; the ids are the indices.
std::string camerasJson(const std::vector<SourceCamera>& cameras);

// A trajectory of schemas/trajectory.schema.json. Fields that are zero, empty or -1 are left out.
struct CameraPath {
    std::string name;        // name of the model and of its file
    double fps = 0, ipd = 0; // ipd in world units
    std::string description;
    double metre = 0; // world units
    std::vector<SourceCamera> frames;
};
std::string trajectoryJson(const CameraPath& path);

} // namespace gsc
