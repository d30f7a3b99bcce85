// SPDX-License-Identifier: Apache-2.0
// Checks CAMS, the cameras from which a player can start.
#include "format/validate/gsc_validate.h"
#include <gsc/utf8.h>

#include <cmath>
#include <cstddef>

namespace gsc::validate {

namespace {

constexpr uint32_t kMaxCameraSize = 32768; // largest width and height of a player's pictures in pixels

// Reports values that are not finite; returns false if there is one.
bool checkPose(Context& context, const CameraRecord& camera, uint64_t i, uint64_t at)
{
    const auto finite = [&](const char* name, const double* values, uint32_t count, size_t offset) {
        for (uint32_t k = 0; k < count; ++k)
            if (!std::isfinite(values[k])) {
                GSC_REPORT(context.log, CameraPose, at + offset + 8 * k, place("cameras", i, name), name, k);
                return false;
            }
        return true;
    };
    const bool has_position = finite("position", camera.position, 3, offsetof(CameraRecord, position));
    return finite("rotation", camera.rotation, 9, offsetof(CameraRecord, rotation)) && has_position;
}

// Warns of a rotation matrix that is not orthonormal. It is no error: cameras.json holds rounded numbers, and some
// pipelines write scaled or sheared matrices.
void checkRotation(Context& context, const CameraRecord& camera, uint64_t i, uint64_t at)
{
    for (uint32_t a = 0; a < 3; ++a)
        for (uint32_t b = a; b < 3; ++b) {
            double product = 0;
            for (uint32_t row = 0; row < 3; ++row)
                product += camera.rotation[3 * row + a] * camera.rotation[3 * row + b];
            const int expected = a == b ? 1 : 0;
            if (!(std::fabs(product - expected) <= 1e-3)) {
                GSC_REPORT(context.log, CameraRotation, at + offsetof(CameraRecord, rotation),
                           place("cameras", i, "rotation"), a, b, product, expected);
                return;
            }
        }
}

void checkName(Context& context, const CameraRecord& camera, uint64_t i, uint64_t at)
{
    IssueLog& log = context.log;
    const std::string_view names = context.view.camera_names;
    if (camera.name_offset > names.size() || camera.name_bytes > names.size() - camera.name_offset) {
        GSC_REPORT(log, CameraNameRange, at + offsetof(CameraRecord, name_offset), place("cameras", i, "name_offset"),
                   camera.name_bytes, camera.name_offset, uint64_t(names.size()));
        return;
    }
    const std::string_view name = names.substr(camera.name_offset, camera.name_bytes);
    size_t good = utf8Prefix(name);
    for (size_t k = 0; k < good; ++k)
        if (uint8_t(name[k]) < 0x20 || name[k] == 0x7f)
            good = k;
    if (good != name.size())
        GSC_REPORT(log, CameraNameText, at + offsetof(CameraRecord, name_offset), place("cameras", i, "name"),
                   unsigned(good));
}

} // namespace

void checkCameras(Context& context)
{
    IssueLog& log = context.log;
    const bool has_appearance = context.view.params->appearance_dim > 0;
    for (uint64_t i = 0; i < context.view.cameras.size(); ++i) {
        const CameraRecord& camera = context.view.cameras[i];
        const uint64_t at = context.offsetOf(kSectionCameras) + i * sizeof(CameraRecord);
        if (checkPose(context, camera, i, at))
            checkRotation(context, camera, i, at);
        if (!std::isfinite(camera.fx) || !std::isfinite(camera.fy) || !(camera.fx > 0) || !(camera.fy > 0))
            GSC_REPORT(log, CameraFocal, at + offsetof(CameraRecord, fx), place("cameras", i, "fx"), camera.fx,
                       camera.fy);
        if (camera.width < 1 || camera.width > kMaxCameraSize || camera.height < 1 || camera.height > kMaxCameraSize)
            GSC_REPORT(log, CameraSize, at + offsetof(CameraRecord, width), place("cameras", i, "width"), camera.width,
                       camera.height, kMaxCameraSize);
        checkName(context, camera, i, at);
        // `appearance` is a row of the trainer's table, which EMBD need not have: players look for it there
        if (camera.appearance < -1 || (camera.appearance >= 0 && !has_appearance))
            GSC_REPORT(log, CameraAppearance, at + offsetof(CameraRecord, appearance),
                       place("cameras", i, "appearance"), camera.appearance,
                       has_appearance ? " or a row of the trainer's table" : ", the model has no embedding");
        if (camera.is_test > 1)
            GSC_REPORT(log, CameraFlag, at + offsetof(CameraRecord, is_test), place("cameras", i, "is_test"),
                       camera.is_test);
        for (uint32_t k = 0; k < std::size(camera.reserved); ++k)
            if (camera.reserved[k] != 0)
                GSC_REPORT(log, CameraReserved, at + offsetof(CameraRecord, reserved) + 4 * k,
                           place("cameras", i, "reserved"), k, camera.reserved[k]);
    }
}

} // namespace gsc::validate
