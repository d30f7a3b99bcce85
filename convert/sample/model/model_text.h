// SPDX-License-Identifier: Apache-2.0
// Writes the text files of a model: PLY header, cfg_args, cameras.json, trajectories.
#pragma once

#include <gsc/source_camera.h>

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

std::string plyHeader(uint64_t anchors, bool octree, uint32_t feat_dim, uint32_t n_offsets);

// Training arguments that differ between sample models; all others are those of the trainers' own scripts.
struct TrainingArguments {
    std::string scene; // name that source_path and model_path in cfg_args end with
    bool everything_on = false;
    uint32_t appearance_dim = 0;
    double voxel_size = 0; // Scaffold-GS: edge of a voxel in world units
    int base_layer = 0;    // Octree-GS: see AnchorGrid::base_layer
};

std::string scaffoldArguments(const TrainingArguments& arguments);
std::string octreeArguments(const TrainingArguments& arguments);

// cameras.json with the keys and their order as the trainers write it; a camera's id is its index.
std::string camerasJson(const std::vector<SourceCamera>& cameras);

// A trajectory, see schemas/trajectory.schema.json. Fields that are 0, empty or -1 are not written.
struct CameraPath {
    std::string name;        // name of the trajectory and of its file
    double fps = 0, ipd = 0; // frames per second; distance of the eyes in world units
    std::string description;
    double metre = 0; // world units to a metre of the viewer's body
    std::vector<SourceCamera> frames;
};
std::string trajectoryJson(const CameraPath& path);

} // namespace gsc
