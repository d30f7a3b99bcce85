// SPDX-License-Identifier: Apache-2.0
// `gsc bake`: the smallest file that keeps a stated quality, found by rendering. Options and report are plain data; what is
// measured on the way is in the bake's own class (bake.cpp) and, for one that is stopped, in a file (state/bake_state.h).
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
    std::string name;  // of the input in messages and in the report, where it is another
    std::string output;
    bool overwrite = false;
    std::vector<std::string> cameras; // camera files; none = those stored
    CamerasTransform cameras_transform = CamerasTransform::Told;
    bool ignore_distortion = false; // of `cameras`
    uint32_t levers = kAllLevers;
    std::optional<double> target_psnr;   // dB; none = only what never draws is left out
    std::optional<double> min_view_psnr; // dB; none = 4 below the target
    uint64_t max_bytes = 0;              // of the archive, 0 = any
    PoseLimits limits;
    DeviceId device; // what draws the pictures of the search and of the verdict
    int threads = 0;
    // A file that keeps what has been measured, and is gone on from where it exists; empty = none. It is bound to all that
    // bakeFacts() has of these options. While weights are found it is written this many seconds apart, or more.
    std::string resume;
    double resume_seconds = 30;
};

struct BakeStage {
    std::string name;
    double seconds;
};

struct BakeReport {
    uint64_t anchors = 0, anchors_left_out = 0, anchors_unseen = 0;
    uint64_t slots = 0, slots_masked = 0; // of the anchors that stay
    uint32_t levers = 0;                  // those that were used
    BakePlan plan;
    uint32_t probes = 0; // of the search
    size_t weight_poses = 0;
    SetScore search, verdict;
    double target = 0, min_view = 0; // dB, 0 = none
    BakeSizes before, after;
    uint64_t pictures_drawn = 0, pictures_kept = 0; // kept: that a bake before had drawn for BakeOptions::resume
    std::string device;                             // what drew
    std::vector<std::string> warnings;              // what was passed over and why
    std::vector<BakeStage> stages;
    double seconds = 0;
};

// Told how far it is, in pictures that were drawn and will be.
using BakeProgress = std::function<void(const char* stage, uint64_t done, uint64_t total)>;

// Throws Error: Difference where the target cannot be kept, naming the pose; Usage for too few cameras; as Scene::open()
// and writeGsc(); as BakeState. Then no file is left, but for BakeOptions::resume, which goes when the output is written, and
// only then. Bytes do not depend on the number of threads, but on the device: its pictures are rounded differently.
BakeReport bake(const BakeOptions& options, const BakeProgress& progress);

// Cost of a model at one of several qualities: bytes, memory and time against pictures.
struct CurvePoint {
    std::optional<double> target; // dB; none: the model itself
    uint64_t anchors = 0;
    BakeSizes sizes;
    FileScore score; // against the model itself, from the poses of the verdict
};

struct Curve {
    uint64_t anchors = 0;              // of the model
    std::string device;                // what drew
    std::vector<CurvePoint> points;    // the model, then the targets that can be kept, in the order asked for
    std::vector<std::string> warnings; // targets that cannot be kept and why; what was passed over
    uint64_t pictures_kept = 0;        // that a bake before had drawn for BakeOptions::resume
    double seconds = 0;
};

// Bakes to each of `targets`, as bake() would one by one; BakeOptions::output is not used. `scratch`: a file that is
// made and removed for each. BakeOptions::resume stays: it is the caller's to remove when the curve is written. Throws as
// bake(); Difference where no target can be kept.
[[nodiscard]] Curve bakeCurve(const BakeOptions& options, const std::vector<double>& targets,
                              const std::string& scratch, const BakeProgress& progress);

// Bytes that each lever took off the archive, in the order of kLeverNames; together, the difference of both archives but for
// what is not of anchors or networks.
[[nodiscard]] std::vector<int64_t> leverShares(const BakeReport& report);

} // namespace gsc
