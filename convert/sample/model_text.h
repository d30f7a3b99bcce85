// SPDX-License-Identifier: Apache-2.0
// The text files beside a model: PLY header, cfg_args, cameras.json, trajectory.
#pragma once

#include "convert/sample/vec3.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gsc {

std::string plyHeader(uint64_t anchors, bool octree, uint32_t feat_dim, uint32_t n_offsets);

// Values that differ between sample models; the rest is what training with the shipped scripts leaves.
struct TrainingArguments {
    std::string scene; // last part of source_path and model_path
    bool everything_on = false;
    uint32_t appearance_dim = 0;
    double voxel_size = 0; // Scaffold-GS
    int base_layer = 0;    // Octree-GS
};

std::string scaffoldArguments(const TrainingArguments& arguments);
std::string octreeArguments(const TrainingArguments& arguments);

struct NamedCamera {
    std::string name;
    uint32_t width = 0, height = 0;
    Vec3 position;
    double rotation[9] = {}; // row-major camera-to-world; columns are right, down, forward
    double fx = 0, fy = 0;
    int appearance = -1; // embedding row; -1 = none
};

// Camera at `position` that looks along `forward` with `up` upwards.
NamedCamera lookingAlong(const std::string& name, Vec3 position, Vec3 forward, Vec3 up, uint32_t width, uint32_t height,
                         double fov_x);

// Upstream's order and keys; the ids are the indices.
std::string camerasJson(const std::vector<NamedCamera>& cameras);

// schemas/trajectory.schema.json. What is zero, empty or -1 is left out.
struct TrajectoryText {
    std::string name;
    double fps = 0, ipd = 0; // ipd in world units
    std::string description;
    double metre = 0; // world units
};
std::string trajectoryJson(const TrajectoryText& text, const std::vector<NamedCamera>& cameras);

} // namespace gsc
