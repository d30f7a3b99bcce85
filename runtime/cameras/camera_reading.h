// SPDX-License-Identifier: Apache-2.0
// Choices for reading a camera file, the same in every command, and functions that all readers of cameras use.
#pragma once

#include <gsc/camera.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Treatment of poses that nerfstudio moved (its applied_transform and applied_scale).
enum class CamerasTransform : uint8_t {
    Told, // poses stay as the file states them, with a warning
    Keep, // poses stay as the file states them, without a warning, because the user asked for that
    Undo  // poses are moved back to where they were
};

struct CameraReading {
    // true: a lens with distortion is read as a pinhole, with a warning; false: it is refused
    bool ignore_distortion = false;
    CamerasTransform transform = CamerasTransform::Told;
    std::vector<std::string>* warnings = nullptr; // receives a sentence for each assumption; null: warnings are dropped

    void warn(std::string text) const
    {
        if (warnings != nullptr)
            warnings->push_back(std::move(text));
    }
};

// Statements of a trajectory beside its frames. If it states views, each frame is the pose of the head.
struct TrajectoryFacts {
    std::string name;           // name of the trajectory; empty = not stated
    double fps = 0;             // frames per second; 0 = not stated
    double ipd = 0;             // distance of the eyes in world units, 0 = not stated
    std::vector<EyeView> views; // view of each eye, left eye first; empty = not stated
    bool is_path = false;       // successive frames lie near each other; those of photographs need not
};

// Computes Camera::translation, -R^T p, of a camera at position p in the world with Camera::rotation R. All code that
// knows a position uses this function, so that equal positions give equal bits.
void translationFromPosition(const double rotation[9], const double position[3], double out[3]);

// Angle of view in radians, from side to side, of `pixels` pixels at a focal length in pixels.
double angleOf(double pixels, double focal);
// Moves the image off the axis: its middle then lies `share_x` of its width to the right and `share_y` of its height
// below the axis. Precondition: the camera's angles are known.
void setMiddle(Camera& camera, double share_x, double share_y);
// Returns the file's name without folders, cut at the first dot, as the trainers name images.
std::string imageName(const std::string& path);

} // namespace gsc
