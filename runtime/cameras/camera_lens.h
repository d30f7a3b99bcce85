// SPDX-License-Identifier: Apache-2.0
// What a camera file says of a lens beside its focal length: distortion, and the pixel its axis meets.
#pragma once

#include "runtime/cameras/camera_notes.h"
#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace gsc {

// The keys of a frame, which stand for those of the whole file where the frame lacks them.
struct LensKeys {
    const JsonObject& frame;
    const JsonObject* file = nullptr; // null: the frame stands alone
    CameraNotes* notes = nullptr;     // is told of keys that both have with different values

    // Where `key` is read, null if it is nowhere; without `null_counts` a value of null is as if it were not there.
    [[nodiscard]] const JsonObject* holder(const char* key, bool null_counts = true) const;
};

// What DistortionCheck reads.
constexpr std::array<std::string_view, 31> kDistortionKeys = {"camera_model", "is_fisheye",
                                                              "latlong",      "equirectangular",
                                                              "orthographic", "distortion_params",
                                                              "k0",           "k1",
                                                              "k2",           "k3",
                                                              "k4",           "k5",
                                                              "k6",           "p0",
                                                              "p1",           "p2",
                                                              "p3",           "p4",
                                                              "s0",           "s1",
                                                              "s2",           "s3",
                                                              "s4",           "sx1",
                                                              "sy1",          "omega",
                                                              "ftheta_p0",    "ftheta_p1",
                                                              "ftheta_p2",    "ftheta_p3",
                                                              "ftheta_p4"};

// Finds what no pinhole shows: a coefficient such as k1 or p2 that is not 0, another camera model, a fisheye lens.
class DistortionCheck {
public:
    // Where `how` ignores such lenses, it is told so in one sentence for the file; otherwise they are refused.
    DistortionCheck(std::string file, const CameraReading& how);

    // Throws Error(Unsupported) for a lens that is not ignored or has no pinhole (a panorama), Error(InvalidFile) for a key of the wrong type.
    void add(const LensKeys& lens);
    // After the last camera.
    void finish();

private:
    void found(const JsonObject& holder, const char* key, bool has_pinhole);

    std::string m_file, m_first;
    const CameraReading& m_how;
    size_t m_cameras = 0, m_distorted = 0;
};

// Pixels from where the axis meets the image (cx, cy) to the middle of `width` x `height`, right and down; 0 for what
// is not stated. Throws Error(InvalidFile), also where cx or cy is there and the size is not (0).
struct MiddleOffset {
    double x = 0, y = 0;
};
MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height);
// For a file of our own, which has "views" instead: throws Error(InvalidFile) where cx or cy is there.
void refuseMiddleOffset(const LensKeys& lens);

} // namespace gsc
