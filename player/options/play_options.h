// SPDX-License-Identifier: Apache-2.0
// What is to be rendered and how, as a plain struct.
#pragma once

#include <gsc/frame_types.h>
#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/length.h"
#include "player/output/picture_stream.h"
#include "player/options/shard.h"
#include "runtime/service/faulty_renderer.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

// Where an eye looks, around which everything is drawn.
enum class FoveationMode { None, Fixed, Gaze };

// What a sweep varies from run to run.
struct RunChoice {
    std::string backend = "auto";
    Tier tier = Tier::Fast;
    double lod_bias = 0;                     // levels added
    double lod_fade = 0, lod_hysteresis = 0; // levels, as FrameOptions has them
    FoveationMode foveation = FoveationMode::None;
    double fovea_pixels = 2; // of foveation: Foveation::smallest
    StereoMode stereo = StereoMode::Exact;
    ReuseOptions reuse; // what is kept between frames

    [[nodiscard]] double foveaPixels() const { return foveation == FoveationMode::None ? 0 : fovea_pixels; }
};

// Devices that draw together, by their number.
struct WorkerCount {
    bool given = false, all = false, on_cpu = false;
    uint32_t number = 0;
};

struct WorkerOptions {
    WorkerCount count;
    std::vector<DeviceId> devices; // by name; not with a count
    ServiceMode mode = ServiceMode::Auto;
    double min_fps = 0, max_fps = 0; // 0 = no such limit
    std::optional<Faults> faults;

    [[nodiscard]] bool several() const { return count.given || !devices.empty(); } // or one, which was named so
};

struct PlayOptions : RunChoice {
    std::string input;
    std::string cameras = "stored"; // a file, or "stored": those in the .gsc
    int eyes = 1;
    Length ipd;                     // of two eyes
    uint32_t width = 0, height = 0; // 0 = the camera's
    double fov_x = 0;               // radians, 0 = the camera's
    bool ignore_distortion = false; // of the lenses in a camera file, which is refused otherwise
    CamerasTransform cameras_transform = CamerasTransform::Told; // of a camera file
    std::string out; // pattern, empty = write nothing, "-" = a stream on standard output
    PixelDepth depth = PixelDepth::Eight;
    StreamFormat stream = StreamFormat::Y4m;      // of --out -
    std::string video;                            // file, empty = none
    double fps = 30;                              // of a Y4m and of a video
    std::string stats;                            // file, empty = none
    int device = 0;                               // of the backend's
    int threads = 0;                              // 0 = all cores
    uint64_t vram_budget = 0;                     // bytes, 0 = all there is
    bool first_picture = false;                   // drawn while the model comes to the device
    int appearance = -1;                          // the trainer's embedding row, -1 = the camera's
    std::optional<std::vector<float>> background; // 3 values; none = the model's
    WorkerOptions workers;
    double near_z = 0;    // world units, 0 = the model's
    double target_ms = 0; // of a frame, held by a falling lod_bias; 0 = none
    uint64_t frame_first = 0, frame_end = std::numeric_limits<uint64_t>::max();
    std::string frame_range;           // as typed with its option, "--frames 0:100"
    bool frames_may_end_sooner = true; // frame_end is at most that
    bool overwrite = false, verify = false;
    Shard shard; // of the tasks: frames, rows of a sweep or trajectories
};

// "2:5" is frames 2, 3 and 4; either end may be left out. False for anything else, and where A is not below B.
bool parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end);

} // namespace gsc
