// SPDX-License-Identifier: Apache-2.0
// Cameras and models for the tests of selection and of the cut cache.
#pragma once

#include "kernels/math/anchor.h"
#include "kernels/select/classify.h"
#include "tests/kernels/synthetic_model.h"

#include <cmath>
#include <limits>

namespace gsc::test {

// The same camera, a way to the right.
inline EyeParams shifted(EyeParams eye, float right)
{
    eye.world_to_view[3] -= right;
    for (int c = 0; c < 4; ++c)
        eye.full_projection[c] = eye.world_to_view[c] / eye.tan_fov_x;
    for (int c = 0; c < 3; ++c)
        eye.center[c] += right * eye.world_to_view[c];
    return eye;
}

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

// A head whose eye and rules change every few frames, while it stands still and while it moves.
struct ChangingView {
    Head head;
    float fov = 1, bias = 0, near_z = 0, stretch = 1;
    uint32_t width = 300;

    EyeParams next(Random& random, int frame)
    {
        if (frame % 4 == 0) {
            fov = random.uniform() < 0.3f ? random.uniform(0.3f, 2.0f) : fov;
            bias = random.uniform() < 0.3f ? random.uniform(-1, 1) : bias;
            near_z = random.uniform() < 0.3f ? random.uniform(0.1f, 4) : near_z;
            stretch = random.uniform() < 0.3f ? random.uniform(0.5f, 2) : 1;
            width = random.uniform() < 0.3f ? 100 + uint32_t(300 * random.uniform()) : width;
        }
        if (frame % 4 > 1)
            head.move(random, 0.002f, 0.001f);
        EyeParams eye = head.eye(fov, width, 200);
        for (int i = 0; i < 4; ++i) {
            eye.world_to_view[i] *= stretch;
            eye.full_projection[i] *= stretch;
        }
        return eye;
    }
};

inline SyntheticOptions unprovenModel()
{
    SyntheticOptions options = smallModel(LevelRule::None, RasterRules::DiffGaussian);
    options.anchors = 1000;
    options.encoding = PositionEncoding::Float;
    return options;
}

// Anchors of which some have scales and positions that nothing is proven about.
inline SyntheticAnchors unprovenAnchors()
{
    constexpr float kInf = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
    SyntheticAnchors anchors = randomAnchors(unprovenModel());
    for (size_t i = 0; i < anchors.count(); i += 97) {
        anchors.scale[6 * i] = i % 2 ? kInf : -kInf;
        anchors.scale[6 * (i + 1)] = kNan;
        anchors.scale[6 * (i + 2)] = 3; // far larger than the scene
        anchors.position[3 * (i + 3)] = kNan;
    }
    return anchors;
}

// What the quick look reads of a group.
inline GroupLanes lanesOf(const ModelView& model, const GroupRecord& group)
{
    GroupLanes lanes{};
    lanes.count = group.anchor_count;
    const uint32_t first = group.anchor_first - model.chunks[group.chunk].anchor_first;
    for (uint32_t i = 0; i < lanes.count; ++i) {
        const Vec3<float> p = anchorPosition(model, group.chunk, first + i);
        const float* scale = model.arrays[group.chunk].scale + size_t(6) * (first + i);
        lanes.x[i] = p.x;
        lanes.y[i] = p.y;
        lanes.z[i] = p.z;
        lanes.log_sigma[i] = maxNumber(scale[0], maxNumber(scale[1], scale[2]));
        lanes.extra_level[i] = anchorExtraLevel(model, group.chunk, first + i);
    }
    return lanes;
}

inline LodClassifier lodOf(const ModelView& model, const GroupRecord& group, float fade = 0)
{
    const int32_t level = model.levels[group.level_index].level;
    return lodClassifier(*model.params, level, lodShift<float>(*model.params, level), 0, fade);
}

} // namespace gsc::test
