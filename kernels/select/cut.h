// SPDX-License-Identifier: Apache-2.0
// The cut cache: what the last test of a chunk or group found, per eye, and the camera motion for which that stays
// exactly true. Every test of selection is a plane or a distance against an anchor. With c the camera centre at the
// test, a plane's value at x changes by at most turn * |x - c| + shift afterwards, turn being the change of the plane's
// normal and shift that of its value at c; a distance changes by at most the motion of the centre. An outcome found
// with a margin of `slack` thus holds while turn * reach + shift < slack, `reach` being the farthest |x - c|. Turn and
// shift are computed from the planes themselves, so no kind of motion or projection needs a rule of its own.
#pragma once

#include "kernels/common/buffer.h"
#include "kernels/select/classify.h"
#include "kernels/select/select.h"

#include <vector>

namespace gsc {

// Margins are taken with this much of the summands' magnitude to spare: kPlaneSlack for the test of the later frame, the
// rest for the roundings of the margin itself and of kSigmaDrift.
constexpr float kCutPlaneSlack = 3 * kPlaneSlack;
constexpr float kCutLodSlack = 2 * kLodSlack;
// Relative change of a plane's sigma_factor (a rounding, as long as the projection is the same) that is tolerated.
constexpr float kSigmaDrift = 1e-6f;

// Factors that turn an eye's plane values into world units: 1 / |n|.
struct CutScales {
    float bounds[5];
    float inside[4];
    float depth;
};

CutScales cutScales(const EyeClassifier& eye);

// Largest motion (turn * reach + shift) for which each anchor of a group keeps the class that classifyGroup() gave it;
// 0 for those it left open. `slacks` has room for lanes.count, rounded up to 16.
void laneSlacks(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const GroupLanes& lanes,
                float* slacks);

// The same for a box that rejectsBox() or rejectsLevel() rejects.
float boxSlack(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const float* box_min,
               const float* box_max, float sigma, float extra_max);

// Motion of an eye since one of its earlier poses.
struct CutMotion {
    float turn, shift;
};

// Rounded up; infinite where the outcomes cannot be compared.
CutMotion cutMotion(const EyeParams& from_eye, const EyeClassifier& from, const CutScales& scales,
                    const EyeParams& to_eye, const EyeClassifier& to);

// Outcome of a test. The cache is read once per frame from end to end.
struct CutEntry {
    uint64_t visible[kGroupSize / 64];
    uint64_t open[kGroupSize / 64]; // anchors that take the exact test in every frame, unless the camera stands still
    float slack;                    // of the others; negative: there is no outcome
    float reach;
    uint32_t pose; // number of the pose that it was found at
    uint32_t reserved;
};

class CutCache {
public:
    // Forgets every outcome; for another model or other parameters of it. The memory stays.
    void clear();

    // Makes `eyes` the current ones. Drops what was found under other rules.
    void begin(const SelectArgs& args, const EyeClassifier* eyes);

    // Outcome for a chunk or group, if it still holds; null otherwise. A chunk's is that nothing of it is visible.
    [[nodiscard]] const CutEntry* chunk(uint32_t eye, size_t chunk) const
    {
        return find(m_eyes[eye], m_eyes[eye].chunks[chunk], uint32_t(chunk));
    }
    [[nodiscard]] const CutEntry* group(uint32_t eye, size_t group) const
    {
        return find(m_eyes[eye], m_eyes[eye].groups[group], uint32_t(group));
    }

    // Keeps an outcome of the current pose. May be called for different records at once.
    void keepChunk(uint32_t eye, size_t chunk, float slack);
    void keepGroup(uint32_t eye, size_t group, float slack, const uint64_t* visible, const uint64_t* open);

    // Slack of a group whose anchors have `slacks`, apart from those in `open`. Those that would soon have the whole
    // group tested again join them, where that is cheaper at the camera's present speed.
    float settle(uint32_t eye, size_t group, const float* slacks, uint64_t* open) const;

    // Whether the eye is not exactly where the outcome was found.
    [[nodiscard]] bool moved(uint32_t eye, const CutEntry& entry) const
    {
        const CutMotion& motion = m_eyes[eye].motion[entry.pose % kPoses];
        return motion.turn > 0 || motion.shift > 0;
    }

    [[nodiscard]] const CutScales& scales(uint32_t eye) const
    {
        return m_eyes[eye].pose[m_eyes[eye].now % kPoses].scales;
    }
    [[nodiscard]] uint64_t bytes() const; // none before begin()

private:
    // Outcomes are given up when their pose is this old, so that a motion is computed for few poses only.
    static constexpr uint32_t kPoses = 64;

    struct Pose {
        EyeParams eye;
        EyeClassifier classifier;
        CutScales scales;
    };
    struct Rules { // what outcomes depend on beside the pose
        RasterConstants raster;
        float lod_bias;
    };
    struct Eye {
        std::vector<CutEntry> chunks, groups;
        Pose pose[kPoses] = {};
        CutMotion motion[kPoses] = {}; // from pose[i] to the current one
        uint32_t now = 0;              // number of the current pose, 0 = none yet
        Rules rules = {};
    };

    // note: the life of an outcome differs from record to record, or all found in one frame would be tested in one
    [[nodiscard]] static const CutEntry* find(const Eye& eye, const CutEntry& entry, uint32_t record)
    {
        const uint32_t life = kPoses / 2 + ((record * 2654435769u) >> 27);
        if (eye.now - entry.pose >= life)
            return nullptr;
        const CutMotion& motion = eye.motion[entry.pose % kPoses];
        return motion.turn * entry.reach + motion.shift <= entry.slack ? &entry : nullptr; // false for NaN
    }
    template <typename Record>
    void keep(Eye& eye, CutEntry& entry, const Record& record, float slack) const;

    const ModelView* m_model = nullptr;
    Eye m_eyes[kMaxEyes];
};

} // namespace gsc
