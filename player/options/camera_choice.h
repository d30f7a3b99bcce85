// SPDX-License-Identifier: Apache-2.0
// Cameras that a run looks through, and the size of their pictures.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/length.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Frames that are made of the cameras chosen.
enum class CameraMotion {
    None,
    Turntable,   // a full turn round the model
    Interpolate, // a smooth way through the cameras
};

constexpr double kDefaultFps = 30; // frames per second where neither the user nor a trajectory states them

struct CameraChoice {
    std::string file = "stored";    // a camera file or a folder of cameras, or "stored": those in the .gsc
    std::vector<std::string> names; // names of the cameras to take, in this order; empty = all
    // A camera of one's own in place of those of the file, which give it their first lens and say where up is; both or
    // none. World units.
    std::optional<std::array<double, 3>> position, look_at;
    CameraMotion motion = CameraMotion::None;
    double seconds = 0; // length of the motion; 0 = by its kind
    double fps = 0;     // frames per second of a motion, a video and a stream; 0 = the trajectory's, else kDefaultFps
    // draw cameras as if they had no lens distortion; false: files with distortion are refused
    bool ignore_distortion = false;
    CamerasTransform transform = CamerasTransform::Told;
    int appearance = -1; // row of the trainer's appearance embedding; -1 = the camera's own
    uint64_t first = 0, end = std::numeric_limits<uint64_t>::max();
    std::string range;          // option and value as typed, "--frames 0:100", for messages
    bool may_end_sooner = true; // false: a range of frames that ends behind the last camera is an error

    [[nodiscard]] bool makesCameras() const { return position || motion != CameraMotion::None; }
    [[nodiscard]] bool isFile() const { return file != "stored"; }
    [[nodiscard]] CameraChoice of(const std::string& other) const // returns this choice with another camera file
    {
        CameraChoice choice = *this;
        choice.file = other;
        return choice;
    }
};

struct ViewChoice {
    uint32_t width = 0, height = 0; // size of a picture in pixels, 0 = the camera's; one side alone keeps its aspect
    double fov_x = 0;               // horizontal angle of view in radians, 0 = the camera's
    int eyes = 1;
    Length ipd;                // distance between two eyes; unset = as the camera file or the model's metre gives
    bool sizes_others = false; // width and height count only for cameras that state no size
};

// Parses the value of --cameras into `file` and `names`: "stored", "stored:NAME", "stored:NAME,NAME" or a path. Returns
// false if a name is empty.
bool parseCameras(const std::string& text, CameraChoice& choice);

// Parses a place, "X,Y,Z" in world units. None for anything else, and for numbers beyond 1e15.
std::optional<std::array<double, 3>> parsePlace(const std::string& text);

// Parses a range of frames: "2:5" is frames 2, 3 and 4; either end may be left out. Returns false for anything else,
// and if the first number is not below the second.
bool parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end);

} // namespace gsc
