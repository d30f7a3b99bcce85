// SPDX-License-Identifier: Apache-2.0
// Cameras and models for the tests of the cut cache.
#pragma once

#include "tests/kernels/synthetic_model.h"

#include <cmath>

namespace gsc::test {

// A head: where it is and where it looks.
struct Head {
    float position[3] = {0, 0, 0};
    float yaw = 0, pitch = 0;

    void move(Random& random, float step, float turn)
    {
        for (float& p : position)
            p += step * random.uniform(-1, 1);
        yaw += turn * random.uniform(-1, 1);
        pitch = std::fmin(1.4f, std::fmax(-1.4f, pitch + turn * random.uniform(-1, 1)));
    }

    [[nodiscard]] EyeParams eye(float fov, uint32_t width, uint32_t height) const
    {
        const float target[3] = {position[0] + std::sin(yaw) * std::cos(pitch), position[1] + std::sin(pitch),
                                 position[2] + std::cos(yaw) * std::cos(pitch)};
        return lookAt(position, target, fov, width, height);
    }
};

inline EyeParams shifted(EyeParams eye, float right)
{
    eye.world_to_view[3] -= right;
    for (int c = 0; c < 4; ++c)
        eye.full_projection[c] = eye.world_to_view[c] / eye.tan_fov_x;
    for (int c = 0; c < 3; ++c)
        eye.center[c] += right * eye.world_to_view[c];
    return eye;
}

// Moves like a walk, a turn, a tremble, a stand and a jump, some frames of each.
inline void nextHead(Random& random, int frame, Head& head, Head& home)
{
    switch (frame / 12 % 6) {
    case 0: // walk straight on
        for (int i = 0; i < 3; ++i)
            head.position[i] += 0.03f * float(i + 1) * (frame / 72 % 2 ? 1.0f : -1.0f);
        break;
    case 1: // turn on the spot
        head.yaw += 0.02f;
        break;
    case 2: // tremble round a pose
        if (frame % 12 == 0)
            home = head;
        head = home;
        head.move(random, 0.01f, 0.004f);
        break;
    case 3: // stand still
        break;
    case 4:
        head.move(random, 0.05f, 0.05f);
        break;
    default:
        if (frame % 6 == 0)
            for (int i = 0; i < 3; ++i)
                head.position[i] = random.uniform(-6, 6);
        head.move(random, 0.002f, 0.1f);
    }
}

inline SyntheticOptions smallModel(LevelRule rule, RasterRules raster)
{
    SyntheticOptions options;
    options.anchors = 4000;
    options.n_offsets = 1;
    options.feat_dim = 4;
    options.log_scale = -5;
    options.raster_rules = raster;
    options.level_rule = rule;
    options.levels = rule == LevelRule::None ? 1 : 4;
    options.flags = rule == LevelRule::None ? 0 : kModelHasLevels | kModelLodHalfCell;
    options.seed = 31 + uint32_t(rule);
    return options;
}

} // namespace gsc::test
