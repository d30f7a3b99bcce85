// SPDX-License-Identifier: Apache-2.0
// `gsc bake`: finds the smallest file of a stated quality by drawing pictures. Options and report are plain data.
// Measurements are held by class Baker (bake.cpp) and also in a file (state/bake_state.h), from which a stopped bake
// continues.
#pragma once

#include "convert/bake/model/archive_size.h"
#include "convert/bake/model/reduced_model.h"
#include "convert/bake/pictures/picture_probe.h"
#include "convert/bake/pictures/pose_sets.h"
#include "runtime/cameras/camera_reading.h"
#include <gsc/device.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gsc {

struct BakeOptions {
    std::string input; // path of a .gsc file
    std::string name;  // name of the input in messages and in the report; empty = its path
    std::string output;
    std::string output_name; // name of the output in messages; empty = its path
    bool overwrite = false;
    std::vector<std::string> cameras; // paths of camera files; empty = the cameras stored in the input
    CamerasTransform cameras_transform = CamerasTransform::Told;
    bool ignore_distortion = false; // draw the cameras of these files as if they had no lens distortion
    uint32_t levers = kAllLevers;
    std::optional<double> target_psnr;   // dB; none = only leave out Gaussians that are never drawn
    std::optional<double> min_view_psnr; // dB, least of a single view; none = 4 below target_psnr
    uint64_t max_bytes = 0;              // largest size of the packed file (gsc archive); 0 = no limit
    PoseLimits limits;
    DeviceId device; // device that draws the pictures of search and verdict
    int threads = 0;
    // Path of a file that keeps the measurements; empty = none. A bake continues from it if it exists and has the same
    // bakeFacts(). `resume_seconds`: least time between two writes of it while importance is measured.
    std::string resume;
    double resume_seconds = 30;
};

struct BakeStage {
    std::string name;
    double seconds;
};

struct BakeReport {
    uint64_t anchors = 0, anchors_left_out = 0, anchors_unseen = 0;
    uint64_t slots = 0, slots_masked = 0; // number of slots of the anchors that stay; how many of these are masked
    uint32_t levers = 0;                  // bit mask of the levers that were used
    BakePlan plan;
    uint32_t probes = 0; // number of plans that the search tried
    size_t weight_poses = 0;
    SetScore search, verdict;
    double target = 0, min_view = 0; // dB; 0 = none was asked for
    BakeSizes before, after;
    uint64_t pictures_drawn = 0, pictures_kept = 0; // `kept`: taken from the file of BakeOptions::resume, not drawn
    std::string device;                             // name of the device that drew
    std::vector<std::string> warnings;              // cameras and measurements that were skipped, and why
    std::vector<BakeStage> stages;
    double seconds = 0;
};

// Reports progress: pictures drawn so far, and the number of all.
using BakeProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Throws Error: Difference if the target cannot be kept, with the name of the worst pose; Usage for too few cameras; as
// Scene::open() and writeGsc(); as BakeState. Then no file is left but that of BakeOptions::resume, which is removed
// once the output is written. The bytes do not depend on the number of threads, but on the device, because devices
// round pictures differently.
BakeReport bake(const BakeOptions& options, const BakeProgress& progress);

// One point of a quality curve: bytes, memory and time that a model costs at one quality, with the scores of its
// pictures.
struct CurvePoint {
    std::optional<double> target; // dB; none: the model as it was
    uint64_t anchors = 0;
    BakeSizes sizes;
    FileScore score; // compares pictures with those of the model as it was, from the poses of the verdict
};

struct Curve {
    uint64_t anchors = 0; // anchors of the model as it was
    std::string device;   // name of the device that drew
    // first the model as it was, then the targets that can be kept, in the order in which they were asked for
    std::vector<CurvePoint> points;
    std::vector<std::string> warnings; // targets that cannot be kept and why, and skipped cameras
    uint64_t pictures_kept = 0;        // pictures taken from the file of BakeOptions::resume, not drawn
    double seconds = 0;
};

// Bakes to each of `targets` as bake() would one by one, without BakeOptions::output. `scratch`: path of a file that is
// written and removed for each. The file of BakeOptions::resume stays; the caller removes it once the curve is written.
// Throws as bake(); Difference only if no target can be kept.
[[nodiscard]] Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets,
                              const std::string& scratch, const BakeProgress& progress);

// Bytes that each lever took off the packed file, in the order of kLeverNames. Their sum is the difference between the
// packed files in the bytes of anchors and networks.
[[nodiscard]] std::vector<int64_t> leverShares(const BakeReport& report);

} // namespace gsc
