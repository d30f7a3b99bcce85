// SPDX-License-Identifier: Apache-2.0
// What tests of reuse draw, on a CPU and on a GPU.
#pragma once

#include "tests/kernels/render_tools.h"
#include "tests/kernels/synthetic_model.h"

#include <vector>

namespace gsc::test {

inline SyntheticOptions modelOptions(LevelRule rule = LevelRule::None)
{
    SyntheticOptions options;
    options.anchors = 1200;
    options.seed = 7;
    if (rule != LevelRule::None) {
        options.levels = 4;
        options.level_rule = rule;
        options.flags = kModelHasLevels | kModelLodHalfCell;
    }
    return options;
}

// Frame `i` of a walk round the model, eyes `apart` world units from each other.
inline std::vector<EyeParams> walk(int i, size_t eye_count, float apart = 0.1f)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e) {
        const float position[3] = {0.2f + 0.02f * float(i) + apart * float(e), 0.3f, -5 + 0.01f * float(i)};
        const float target[3] = {0.1f, -0.2f, 0.3f};
        eyes.push_back(lookAt(position, target, 0.9f, 120, 90));
    }
    return eyes;
}

} // namespace gsc::test
