// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint_cameras.h"

#include "convert/input/input_file.h"
#include "format/numbers/count_text.h"
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/trainer_cameras.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <unordered_set>
#include <utility>

namespace gsc {

namespace {

constexpr uint64_t kMaxCameraFile = 1ull << 30;
// largest difference of a rotation's determinant from 1, so that poses printed with few digits are accepted
constexpr double kRigid = 1e-3;
// width in pixels of the largest picture that a player draws of a stored camera if no size is asked for
constexpr uint32_t kMostDrawn = 1600;

SourceCamera fromCamera(const Camera& camera, int id)
{
    SourceCamera result;
    result.name = camera.name;
    result.id = id;
    result.width = camera.width;
    result.height = camera.height;
    std::copy_n(camera.rotation, 9, result.rotation);
    // a camera stores view = R^T world + t, so its centre is -R t; subtracted from zero, so that no coordinate becomes
    // -0.0
    const glm::dvec3 centre = glm::dvec3(0) - glm::make_vec3(camera.translation) * glm::make_mat3(camera.rotation);
    std::copy_n(glm::value_ptr(centre), 3, result.position);
    result.fx = camera.width / (2.0 * std::tan(camera.fov_x / 2));
    result.fy = camera.height / (2.0 * std::tan(camera.fov_y / 2));
    return result;
}

// Warns once per file of camera properties that a .gsc cannot hold. `told`: warnings of the camera file's reader;
// `shifted`: number of cameras whose principal point is not the middle of the picture.
void warnOfLenses(const std::string& path, const std::vector<std::string>& told, size_t shifted, size_t cameras,
                  std::vector<std::string>& warnings)
{
    for (const std::string& text : told) {
        const auto has = [&](const char* part) { return text.find(part) != std::string::npos; };
        warnings.push_back(text + (has(": lens distortion") ? "; a .gsc stores pinholes"
                                   : has("--cameras-transform")
                                       ? "; gsc convert has no such option, gsc-play --cameras has"
                                       : ""));
    }
    if (shifted > 0)
        warnings.push_back(formatString("%s: cx, cy of %s of %s are off the middle of the image and ignored; a "
                                        ".gsc stores cameras that look through the middle, play them from the file "
                                        "itself with gsc-play --cameras",
                                        path.c_str(), formatCount(shifted).c_str(),
                                        formatCount(cameras, "camera").c_str()));
}

// Returns true if a SourceCamera can hold this camera. It cannot without an image size, or if the matrix also scales
// (MatrixCity).
bool representable(const Camera& camera)
{
    const double det = determinant(glm::make_mat3(camera.rotation));
    return camera.width != 0 && camera.height != 0 && std::abs(det - 1) < kRigid;
}

// Reads cameras from transforms*.json, as Blender and the city data sets have them, test cameras first as the trainers
// do. A file that cannot be used only causes a warning, because a conversion does not need cameras.
std::vector<SourceCamera> readTransforms(const CheckpointFiles& files, uint32_t embedding_rows,
                                         std::vector<std::string>& warnings)
{
    std::vector<std::pair<std::string, bool>> paths = {{files.findBeside("transforms_test.json"), true},
                                                       {files.findBeside("transforms_train.json"), false}};
    if (const std::string all = files.findBeside("transforms.json"); paths[1].first.empty() && !all.empty())
        paths = {{all, false}};
    std::vector<SourceCamera> cameras;
    for (const auto& [path, is_test] : paths) {
        if (path.empty())
            continue;
        uint32_t row = 0;
        try {
            std::vector<std::string> told;
            size_t shifted = 0;
            for (const Camera& camera : readCameraFile(path, nullptr, {true, CamerasTransform::Told, &told})) {
                if (!representable(camera))
                    throw Error(ErrorCode::InvalidFile, path,
                                "camera '" + camera.name + "' has no image size or a matrix that scales",
                                "a size and a rotation", "export the cameras again");
                cameras.push_back(fromCamera(camera, int(cameras.size())));
                cameras.back().is_test = is_test;
                cameras.back().appearance = row < embedding_rows ? int(row) : -1;
                shifted += camera.tan_mid_x != 0 || camera.tan_mid_y != 0;
                ++row;
            }
            warnOfLenses(path, told, shifted, row, warnings);
        } catch (const Error& error) {
            warnings.push_back(std::string(error.what()) + "; its cameras are left out");
            return {};
        }
    }
    return cameras;
}

bool idsArePositions(const std::vector<SourceCamera>& cameras)
{
    for (size_t i = 0; i < cameras.size(); ++i)
        if (cameras[i].id != int(i))
            return false;
    return true;
}

// Number of test cameras at the head of the list, if its order is the one that the trainers' split of a COLMAP data set
// makes; else 0. `lod`: as in assignSplit().
size_t countHeldOut(const std::vector<SourceCamera>& cameras, int lod)
{
    std::vector<std::string> names;
    for (const SourceCamera& camera : cameras)
        names.push_back(camera.name);
    std::sort(names.begin(), names.end());
    std::vector<std::string> test, train;
    for (size_t i = 0; i < names.size(); ++i) {
        const bool is_test = lod <= 0 ? i % 8 == 0 : lod < 50 ? int(i) <= lod : int(i) > lod;
        (is_test ? test : train).push_back(names[i]);
    }
    // note: sets are compared and not sequences, because trainers that shuffle do so within the test and within the
    // training cameras
    const std::unordered_set<std::string> held_out(test.begin(), test.end());
    for (size_t i = 0; i < cameras.size(); ++i)
        if ((held_out.count(cameras[i].name) != 0) != (i < test.size()))
            return 0;
    return test.size();
}

// Reads the option `resolution` of the trainer's settings. Values of `resolution_scales` other than 1 were refused
// before (checkpoint_settings.cpp).
double resolutionOf(const ConfigValue* config, const std::string& path, std::vector<std::string>& warnings)
{
    if (config == nullptr)
        return kDefaultResolution;
    CameraReading how;
    how.warnings = &warnings;
    warnOfSmallImages(config->getString("images", "", path), path, how);
    return checkedResolution(config->getNumber("resolution", kDefaultResolution, path), path, how);
}

// Gives the cameras the image size at which the trainer drew them; their angles of view stay. With the trainer's
// default resolution they keep the size of the photographs, and a player limits the size by itself.
void resizeAsTrained(std::vector<SourceCamera>& cameras, double resolution, const std::string& path,
                     std::vector<std::string>& warnings)
{
    if (resolution == kDefaultResolution)
        return;
    size_t larger = 0;
    for (SourceCamera& camera : cameras) {
        const TrainedSize size = trainerSize(camera.width, camera.height, resolution);
        const double across = double(size.width) / camera.width, down = double(size.height) / camera.height;
        camera.fx *= across;
        camera.middle_x *= across;
        camera.fy *= down;
        camera.middle_y *= down;
        camera.width = size.width;
        camera.height = size.height;
        larger += size.width > kMostDrawn;
    }
    if (larger > 0)
        warnings.push_back(formatString("%s: resolution is %g, so the trainer drew %s of %s more than %u pixels "
                                        "wide; a player draws them %u wide, pass --size for the trainer's size",
                                        path.c_str(), resolution, formatCount(larger).c_str(),
                                        formatCount(cameras.size(), "camera").c_str(), kMostDrawn, kMostDrawn));
}

} // namespace

void assignSplit(std::vector<SourceCamera>& cameras, uint32_t embedding_rows, int eval, int lod,
                 std::vector<std::string>& warnings)
{
    if (cameras.empty())
        return;
    size_t held_out = 0;
    if (!idsArePositions(cameras)) {
        warnings.push_back("cameras.json: ids are not 0, 1, 2 and so on, so which images were held out and which "
                           "embedding row belongs to a camera is unknown");
        return;
    }
    if (embedding_rows != 0) {
        if (embedding_rows > cameras.size()) {
            warnings.push_back(formatString("cameras.json: lists %s, the appearance embedding has %s, so "
                                            "which row belongs to a camera is unknown",
                                            formatCount(cameras.size(), "camera").c_str(),
                                            formatCount(embedding_rows, "row").c_str()));
            return;
        }
        held_out = cameras.size() - embedding_rows;
    } else if (eval != 0) {
        held_out = countHeldOut(cameras, lod);
        if (eval < 0 && held_out != 0) {
            held_out = 0;
            warnings.push_back("cameras.json: no settings state 'eval', so which cameras were held out is unknown");
        }
    }
    for (size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].is_test = i < held_out;
        // a test camera has the embedding row of the training camera with the same position in its list, as in the
        // trainers' code
        const size_t row = i < held_out ? i : i - held_out;
        cameras[i].appearance = row < embedding_rows ? int(row) : -1;
    }
}

std::vector<SourceCamera> readCameras(const CheckpointFiles& files, const ConfigValue* config,
                                      const std::string& config_path, uint32_t embedding_rows,
                                      std::vector<std::string>& warnings)
{
    const double resolution = resolutionOf(config, config_path, warnings);
    const std::string path = files.findBeside("cameras.json");
    if (path.empty()) {
        std::vector<SourceCamera> cameras = readTransforms(files, embedding_rows, warnings);
        if (cameras.empty())
            warnings.push_back("cameras.json: not found beside the model, so the file will hold no cameras; pass the "
                               "folder that holds it with --scene-dir");
        resizeAsTrained(cameras, resolution, config_path, warnings);
        return cameras;
    }
    std::vector<std::string> told;
    std::vector<SourceCamera> cameras = parseUpstreamCameras(readTextFile(path, kMaxCameraFile, "a list of cameras"),
                                                             path, {true, CamerasTransform::Told, &told});
    const auto shifted = std::count_if(cameras.begin(), cameras.end(), [](const SourceCamera& camera) {
        return camera.middle_x != 0 || camera.middle_y != 0;
    });
    warnOfLenses(path, told, size_t(shifted), cameras.size(), warnings);
    resizeAsTrained(cameras, resolution, config_path, warnings);
    const ConfigValue* found = config ? config->find("eval") : nullptr;
    const int eval = !found ? -1 : config->getBool("eval", false, config_path) ? 1 : 0;
    const double lod = config ? config->getNumber("lod", 0, config_path) : 0;
    assignSplit(cameras, embedding_rows, eval, lod > 0 && lod < 1e9 ? int(lod) : 0, warnings);
    return cameras;
}

} // namespace gsc
