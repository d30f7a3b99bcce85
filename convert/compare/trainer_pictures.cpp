// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/trainer_pictures.h"

#include <gsc/file/read_file.h>
#include <gsc/error.h>
#include "runtime/cameras/trainer_cameras.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace gsc {

namespace fs = std::filesystem;

namespace {

constexpr uint32_t kMaxSide = 1u << 16;
constexpr uint64_t kMaxCameras = uint64_t(1) << 30; // bytes of a cameras.json

Camera goldenCamera(const nlohmann::json& entry)
{
    Camera camera;
    camera.name = entry.at("image_name").get<std::string>();
    for (size_t row = 0; row < 3; ++row) {
        for (size_t column = 0; column < 3; ++column)
            camera.rotation[3 * row + column] = entry.at("R_camera_to_world").at(row).at(column).get<double>();
        camera.translation[row] = entry.at("T_world_to_camera").at(row).get<double>();
    }
    camera.fov_x = entry.at("FoVx").get<double>();
    camera.fov_y = entry.at("FoVy").get<double>();
    camera.width = entry.at("width").get<uint32_t>();
    camera.height = entry.at("height").get<uint32_t>();
    camera.appearance = entry.value("uid", -1);
    return camera;
}

bool isUsable(const Camera& camera)
{
    const auto angle = [](double value) { return value > 1e-6 && value < 3.1415; };
    return angle(camera.fov_x) && angle(camera.fov_y) && camera.width > 0 && camera.height > 0 &&
           camera.width <= kMaxSide && camera.height <= kMaxSide;
}

} // namespace

std::vector<TrainerPicture> picturesOfGolden(const std::string& folder)
{
    const std::string path = folder + "/cameras.json";
    const std::string text = readInputText(path, kMaxCameras, "the cameras of the pictures");
    std::vector<TrainerPicture> pictures;
    try {
        for (const nlohmann::json& entry : nlohmann::json::parse(text)) {
            const Camera camera = goldenCamera(entry);
            if (!isUsable(camera))
                throw Error(ErrorCode::InvalidFile, path,
                            "camera " + camera.name + " has an angle or size out of range",
                            "a pinhole camera of 1 to 65536 pixels a side", "export the cameras again");
            pictures.push_back({folder + "/" + camera.name + ".png", camera});
        }
    } catch (const nlohmann::json::exception& error) {
        throw Error(
            ErrorCode::InvalidFile, path, error.what(),
            "a list of cameras with image_name, R_camera_to_world, T_world_to_camera, FoVx, FoVy, width, height",
            "export the cameras again");
    }
    return pictures;
}

std::vector<TrainerPicture> picturesOfTest(const std::string& folder, const std::vector<SourceCamera>& cameras)
{
    std::vector<TrainerPicture> pictures;
    int index = 0;
    for (const SourceCamera& stored : cameras) {
        if (!stored.is_test)
            continue;
        const std::string path = folder + formatString("/%05d.png", index++);
        if (fs::is_regular_file(path))
            pictures.push_back({path, cameraOf(stored)});
    }
    return pictures;
}

std::string findTrainerPictures(const Checkpoint& checkpoint)
{
    std::error_code ignored;
    const fs::path model = checkpoint.model_path;
    if (fs::is_regular_file(model / "golden/cameras.json", ignored))
        return (model / "golden").string();
    const fs::path renders = model / "test" / ("ours_" + std::to_string(checkpoint.iteration)) / "renders";
    return fs::is_directory(renders, ignored) ? renders.string() : "";
}

} // namespace gsc
