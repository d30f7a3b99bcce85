// SPDX-License-Identifier: Apache-2.0
// Camera files of all kinds: whatever the bytes are, either finite cameras come out or Error(InvalidFile, Unsupported).
// Lens distortion is ignored.
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/colmap_cameras.h"
#include "runtime/cameras/trainer_cameras.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace {

void requireFinite(const gsc::Camera& camera)
{
    double sum = camera.fov_x + camera.fov_y + camera.focal_x + camera.focal_y + camera.tan_mid_x + camera.tan_mid_y;
    for (const double value : camera.rotation)
        sum += value;
    for (const double value : camera.translation)
        sum += value;
    if (!std::isfinite(sum))
        std::abort();
}

void useCameras(std::vector<gsc::Camera>& cameras, const gsc::TrajectoryFacts& eyes)
{
    for (gsc::Camera& camera : cameras) {
        requireFinite(camera);
        gsc::finishCamera(camera, 64, 48, camera.fov_x > 0 || camera.fov_y > 0 || camera.focal_x > 0 ? 0 : 1);
        const gsc::EyeParams eye = gsc::eyeParams(camera, {});
        if (!(eye.tan_fov_x > 0) || !(eye.tan_fov_y > 0) || !std::isfinite(eye.tan_mid_x) ||
            !std::isfinite(eye.tan_mid_y) || eye.width == 0 || eye.height == 0)
            std::abort();
        for (const gsc::EyeView& view : eyes.views) {
            const gsc::EyeParams of_head = gsc::eyeParams(gsc::eyeOfHead(camera, view), {});
            if (!(of_head.tan_fov_x > 0) || !(of_head.tan_fov_y > 0) || !std::isfinite(of_head.tan_mid_x) ||
                !std::isfinite(of_head.tan_mid_y))
                std::abort();
        }
    }
}

// Whatever `read` does is a result or a refusal of the file.
template <typename Read>
void refuseOrRead(const Read& read)
{
    try {
        read();
    } catch (const gsc::Error& e) {
        if (e.code() != gsc::ErrorCode::InvalidFile && e.code() != gsc::ErrorCode::Unsupported)
            std::abort();
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    std::vector<std::string> told;
    for (const auto transform : {gsc::CamerasTransform::Told, gsc::CamerasTransform::Undo})
        refuseOrRead([&] {
            gsc::TrajectoryFacts eyes;
            std::vector<gsc::Camera> cameras = gsc::parseCameraFile(text, "fuzz.json", &eyes, {true, transform, &told});
            for (const gsc::EyeView& eye : eyes.views)
                if (!(eye.left < eye.right) || !(eye.down < eye.up) || !std::isfinite(eye.position[0]))
                    std::abort();
            useCameras(cameras, eyes);
        });
    const gsc::CameraReading how{true, gsc::CamerasTransform::Told, &told};
    refuseOrRead([&] { (void)gsc::parseUpstreamCameras(text, "fuzz.json", how); });
    const auto colmap = [&](std::string_view cameras, std::string_view images, bool binary) {
        refuseOrRead([&] {
            std::vector<gsc::Camera> read = gsc::parseColmapCameras(cameras, images, binary, "fuzz", how);
            useCameras(read, {});
        });
    };
    colmap("1 PINHOLE 200 150 150 150 100 75\n", text, false);
    colmap(text, "1 1 0 0 0 0 0 0 1 a.png\n\n", false);
    colmap(text.substr(0, size / 2), text.substr(size / 2), true);
    gsc::warnOfSmallImages(std::string(text), "cfg_args", how);
    return 0;
}
