// SPDX-License-Identifier: Apache-2.0
// `gsc bake`: finds the smallest file of a stated quality by rendering. Options and report are plain data; measurements on
// the way lie in class Baker (bake.cpp) and, so that a stopped bake can continue, in a file (state/bake_state.h).
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
    std::string input; // a .gsc file
    std::string name;  // name of the input in messages and in the report, if not its path
    std::string output;
    bool overwrite = false;
    std::vector<std::string> cameras; // camera files; none = those stored
    CamerasTransform cameras_transform = CamerasTransform::Told;
    bool ignore_distortion = false; // draw cameras of `cameras` as if they had no distortion
    uint32_t levers = kAllLevers;
    std::optional<double> target_psnr;   // dB; none = only Gaussians that are never drawn are left out
    std::optional<double> min_view_psnr; // dB; none = 4 below the target
    uint64_t max_bytes = 0;              // largest size of the archive, 0 = any
    PoseLimits limits;
    DeviceId device; // draws the pictures of search and verdict
    int threads = 0;
    // File that keeps measurements; a bake continues from it if it exists; empty = none. It fits only a bake with the same
    // bakeFacts(). `resume_seconds`: least time between two writes while weights are measured.
    std::string resume;
    double resume_seconds = 30;
};

struct BakeStage {
    std::string name;
    double seconds;
};

struct BakeReport {
    uint64_t anchors = 0, anchors_left_out = 0, anchors_unseen = 0;
    uint64_t slots = 0, slots_masked = 0; // slots of the anchors that stay
    uint32_t levers = 0;                  // levers that were used, a bit each
    BakePlan plan;
    uint32_t probes = 0; // plans that the search drew
    size_t weight_poses = 0;
    SetScore search, verdict;
    double target = 0, min_view = 0; // dB, 0 = none
    BakeSizes before, after;
    uint64_t pictures_drawn = 0, pictures_kept = 0; // kept: taken from the file of BakeOptions::resume
    std::string device;                             // name of the device that drew
    std::vector<std::string> warnings;              // cameras and measurements that were skipped, and why
    std::vector<BakeStage> stages;
    double seconds = 0;
};

// Called with the progress: pictures drawn so far, and in all.
using BakeProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Throws Error: Difference where the target cannot be kept, naming the pose; Usage for too few cameras; as Scene::open()
// and writeGsc(); as BakeState. Then it leaves no file but that of BakeOptions::resume, which is removed only when the output
// is written. Bytes do not depend on the number of threads, but on the device: each rounds its pictures differently.
BakeReport bake(const BakeOptions& options, const BakeProgress& progress);

// Cost of a model at one quality: bytes, memory and time, with the scores of its pictures.
struct CurvePoint {
    std::optional<double> target; // dB; none: the model itself
    uint64_t anchors = 0;
    BakeSizes sizes;
    FileScore score; // compared with the model itself, from the poses of the verdict
};

struct Curve {
    uint64_t anchors = 0;              // anchors of the model
    std::string device;                // name of the device that drew
    std::vector<CurvePoint> points;    // the model, then the targets that can be kept, in the order asked for
    std::vector<std::string> warnings; // targets that cannot be kept, and why; skipped cameras
    uint64_t pictures_kept = 0;        // taken from the file of BakeOptions::resume, not drawn again
    double seconds = 0;
};

// Bakes to each of `targets`, as bake() would one by one; BakeOptions::output is not used. `scratch`: file that is made and
// removed for each. The file of BakeOptions::resume stays: the caller removes it when the curve is written. Throws as
// bake(); Difference where no target can be kept.
[[nodiscard]] Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets,
                              const std::string& scratch, const BakeProgress& progress);

// Bytes that each lever took off the archive, in the order of kLeverNames. Their sum is the difference of both archives in
// anchors and networks.
[[nodiscard]] std::vector<int64_t> leverShares(const BakeReport& report);

} // namespace gsc
