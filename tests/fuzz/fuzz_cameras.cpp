// SPDX-License-Identifier: Apache-2.0
// Camera files of all three kinds: whatever the bytes are, either finite cameras come out or Error(InvalidFile). Lens
// distortion is ignored; asked for, its refusal would be the one Error(Unsupported).
#include "format/error.h"
#include "player/cameras/camera_file.h"

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

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        gsc::TrajectoryFacts eyes;
        std::vector<std::string> ignored;
        std::vector<gsc::Camera> cameras = gsc::parseCameraFile(text, "fuzz.json", &eyes, &ignored);
        for (const gsc::EyeView& eye : eyes.views)
            if (!(eye.left < eye.right) || !(eye.down < eye.up) || !std::isfinite(eye.position[0]))
                std::abort();
        for (gsc::Camera& camera : cameras) {
            requireFinite(camera);
            gsc::finishCamera(camera, 64, 48, camera.fov_x > 0 || camera.focal_x > 0 ? 0 : 1);
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
    } catch (const gsc::Error& e) {
        if (e.code() != gsc::ErrorCode::InvalidFile)
            std::abort();
    }
    try {
        std::vector<std::string> ignored;
        (void)gsc::parseUpstreamCameras(text, "fuzz.json", &ignored);
    } catch (const gsc::Error& e) {
        if (e.code() != gsc::ErrorCode::InvalidFile)
            std::abort();
    }
    return 0;
}
