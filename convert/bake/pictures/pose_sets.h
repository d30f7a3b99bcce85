// SPDX-License-Identifier: Apache-2.0
// The poses a bake looks from: three sets that share none.
#pragma once

#include <gsc/camera.h>

#include <vector>

namespace gsc {

struct PoseSets {
    std::vector<Camera> weights; // what slots and anchors are worth is found here
    std::vector<Camera> search;  // how far values may go
    std::vector<Camera> verdict; // never looked from before: what the result is worth
};

struct PoseLimits {
    size_t weights = 48, search = 14, verdict = 16; // of weights, kMostImportancePoses at most
    uint32_t most_pixels = 1'000'000;               // of a picture: larger ones are drawn smaller
};

// Cameras in the order of their names, which is that of the capture where there is one. Each four that follow each
// other give: the first and the third weights, the second the search, the fourth the verdict. Poses on the way join
// them: weights take one near each other camera, three fifths of the way to it from the nearest that gives weights;
// search and verdict take those halfway from their cameras to the next. Over a limit, evenly spread ones are taken.
// Precondition: four cameras or more, finished.
[[nodiscard]] PoseSets splitPoses(std::vector<Camera> cameras, const PoseLimits& limits);

// Keeps the first of cameras with the same place and direction.
void leaveOutRepeats(std::vector<Camera>& cameras);

// `share` of the way from one camera to another, as large as the first.
[[nodiscard]] Camera betweenCameras(const Camera& from, const Camera& to, double share);

} // namespace gsc
