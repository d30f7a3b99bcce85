// SPDX-License-Identifier: Apache-2.0
// The poses of a bake, in three sets without a common pose.
#pragma once

#include <gsc/camera.h>

#include <vector>

namespace gsc {

struct PoseSets {
    std::vector<Camera> weights; // for the importance of slots and anchors
    std::vector<Camera> search;  // for how far values may be rounded
    std::vector<Camera> verdict; // used by nothing before: for the quality of the result
};

struct PoseLimits {
    size_t weights = 48, search = 14, verdict = 16; // most poses of each set; weights: kMostImportancePoses at most
    uint32_t most_pixels = 1'000'000;               // most pixels of a picture: larger ones are drawn smaller
};

// Splits cameras in the order of their names, usually the order of capture. In each row of four, the first and the third
// go to weights, the second to search, the fourth to verdict. Poses between cameras are added: to weights one near each
// camera of the other sets, three fifths of the way to it from the nearest camera of weights; to search and verdict those
// halfway from their cameras to the next. A set over its limit is thinned evenly. Precondition: four finished cameras or
// more.
[[nodiscard]] PoseSets splitPoses(std::vector<Camera> cameras, const PoseLimits& limits);

// Removes cameras whose place and direction an earlier camera has.
void leaveOutRepeats(std::vector<Camera>& cameras);

// Camera at `share` of the way from one to another, with the size of the first.
[[nodiscard]] Camera betweenCameras(const Camera& from, const Camera& to, double share);

} // namespace gsc
