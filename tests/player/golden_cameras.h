// SPDX-License-Identifier: Apache-2.0
// The golden cameras.json beside the trained models: the exact cameras of the trainers' renders.
#pragma once

#include <gsc/camera.h>

#include <nlohmann/json.hpp>

#include <fstream>
#include <string>
#include <vector>

namespace gsc::test {

struct GoldenCamera {
    Camera camera;
    float world_to_view[16];   // row-major, column vectors (the file holds the transpose)
    float full_projection[16]; // the same
    float center[3];
};

inline std::vector<GoldenCamera> readGoldenCameras(const std::string& model)
{
    std::ifstream stream(model + "/golden/cameras.json");
    const nlohmann::json root = nlohmann::json::parse(stream);
    std::vector<GoldenCamera> cameras;
    for (const nlohmann::json& entry : root) {
        GoldenCamera golden{};
        golden.camera.name = entry.at("image_name").get<std::string>();
        for (size_t r = 0; r < 3; ++r) {
            for (size_t c = 0; c < 3; ++c)
                golden.camera.rotation[3 * r + c] = entry.at("R_camera_to_world")[r][c].get<double>();
            golden.camera.translation[r] = entry.at("T_world_to_camera")[r].get<double>();
            golden.center[r] = entry.at("camera_center")[r].get<float>();
        }
        golden.camera.fov_x = entry.at("FoVx").get<double>();
        golden.camera.fov_y = entry.at("FoVy").get<double>();
        golden.camera.width = entry.at("width").get<uint32_t>();
        golden.camera.height = entry.at("height").get<uint32_t>();
        golden.camera.appearance = entry.at("uid").get<int>();
        for (size_t r = 0; r < 4; ++r)
            for (size_t c = 0; c < 4; ++c) {
                golden.world_to_view[4 * r + c] = entry.at("world_view_transform_rowvec")[c][r].get<float>();
                golden.full_projection[4 * r + c] = entry.at("full_proj_transform_rowvec")[c][r].get<float>();
            }
        cameras.push_back(golden);
    }
    return cameras;
}

} // namespace gsc::test
