// SPDX-License-Identifier: Apache-2.0
// Choices for reading a camera file, the same in every command, and helpers of all readers.
#pragma once

#include <gsc/camera.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Treatment of a file whose poses were moved (nerfstudio's applied_transform and applied_scale).
enum class CamerasTransform : uint8_t {
    Told, // poses stay as they stand, with a warning
    Keep, // poses stay as they stand, without a warning, since that was asked for
    Undo  // poses are moved back
};

struct CameraReading {
    bool ignore_distortion = false; // a lens that distorts is taken as a pinhole, with a warning, instead of refused
    CamerasTransform transform = CamerasTransform::Told;
    std::vector<std::string>* warnings = nullptr; // takes a sentence for each thing assumed; null: none are kept

    void warn(std::string text) const
    {
        if (warnings != nullptr)
            warnings->push_back(std::move(text));
    }
};

// Statements of a trajectory beside its frames. With views, a frame is the pose of the head.
struct TrajectoryFacts {
    std::string name;           // empty = not stated
    double ipd = 0;             // world units, 0 = not stated
    std::vector<EyeView> views; // left eye first; empty = not stated
    bool is_path = false;       // frames follow each other, as those of photographs need not
};

// t = -R^T p: Camera::translation of a camera at p (world) with Camera::rotation R. Everything that knows a position goes
// through here, so that the same position gives the same bits.
void translationFromPosition(const double rotation[9], const double position[3], double out[3]);

// The whole angle, radians, that a number of pixels spans at a focal length in pixels.
double angleOf(double pixels, double focal);
// Moves the image so that its middle lies these shares of its sides right and down of the axis. Precondition: the
// camera's angles are known.
void setMiddle(Camera& camera, double share_x, double share_y);
// The file's name without folders, cut at the first dot, as upstream names images.
std::string imageName(const std::string& path);

} // namespace gsc
