// SPDX-License-Identifier: Apache-2.0
// The poses at which the cut cache of an eye found what it holds, and how far the eye has moved since each. Turn and shift
// (cut_margin.h) are computed from the planes themselves, so no kind of motion or projection needs a rule of its own.
#pragma once

#include "kernels/select/cut_margin.h"

namespace gsc {

CutScales cutScales(const EyeClassifier& eye);

// Rounded up; infinite where the outcomes cannot be compared.
CutMotion cutMotion(const EyeParams& from_eye, const EyeClassifier& from, const CutScales& scales,
                    const EyeParams& to_eye, const EyeClassifier& to);

// Outcomes are given up when their pose is about this old, so that a motion is computed for few poses only.
constexpr uint32_t kCutPoses = 64;

// Frames that the outcome of a record may live. It differs from record to record, or all found in one frame would be
// tested in one.
GSC_HD uint32_t cutLife(uint32_t record)
{
    return kCutPoses / 2 + ((record * 2654435769u) >> 27);
}

class CutPoses {
public:
    void clear() { m_now = 0; }

    // Makes a pose the current one. False if nothing found before it means anything: it is the first, or other rules hold.
    bool begin(const EyeParams& eye, const EyeClassifier& classifier, const RasterConstants& rules, float lod_bias);

    [[nodiscard]] uint32_t now() const { return m_now; } // number of the current pose, 0 = none yet
    [[nodiscard]] const EyeClassifier& classifier() const { return m_poses[m_now % kCutPoses].classifier; }
    [[nodiscard]] const CutScales& scales() const { return m_poses[m_now % kCutPoses].scales; }
    // From pose number `pose`, one of the last kCutPoses, to the current one.
    [[nodiscard]] const CutMotion& motion(uint32_t pose) const { return m_motion[pose % kCutPoses]; }
    [[nodiscard]] const CutMotion* motions() const { return m_motion; } // of pose i at i % kCutPoses
    // From the pose before to the current one. Infinite after a jump between projections.
    [[nodiscard]] CutMotion step() const { return m_now > 1 ? motion(m_now - 1) : CutMotion{0, 0}; }

private:
    struct Pose {
        EyeParams eye;
        EyeClassifier classifier;
        CutScales scales;
    };

    Pose m_poses[kCutPoses] = {};
    CutMotion m_motion[kCutPoses] = {};
    uint32_t m_now = 0;
    RasterConstants m_rules = {}; // what outcomes depend on beside the pose
    float m_lod_bias = 0;
};

} // namespace gsc
