// SPDX-License-Identifier: Apache-2.0
// The pictures a trainer rendered itself, with the cameras they were rendered from.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/camera.h>

#include <string>
#include <vector>

namespace gsc {

struct TrainerPicture {
    std::string path; // path of the PNG
    Camera camera;    // takes the size of the picture once that is read
};

// Pictures of a folder with NAME.png and a cameras.json that lists exact cameras (R_camera_to_world, T_world_to_camera,
// FoVx, FoVy, width, height, uid). Throws Error (Io, InvalidFile).
std::vector<TrainerPicture> picturesOfGolden(const std::string& folder);

// Pictures of the folder test/ours_<iteration>/renders that the trainers' render.py leaves: NNNNN.png is the NNNNN-th
// test camera. Empty if there is none.
std::vector<TrainerPicture> picturesOfTest(const std::string& folder, const std::vector<SourceCamera>& cameras);

// <model>/golden, else <model>/test/ours_<iteration>/renders; empty if there is neither.
std::string findTrainerPictures(const Checkpoint& checkpoint);

} // namespace gsc
