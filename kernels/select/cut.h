// SPDX-License-Identifier: Apache-2.0
// The cut cache: what the last test of a chunk or group found, per eye, and the camera motion for which that stays
// exactly true (cut_margin.h). The CPU's.
#pragma once

#include "kernels/common/buffer.h"
#include "kernels/select/cut_poses.h"
#include "kernels/select/select.h"

#include <vector>

namespace gsc {

// Largest motion (turn * reach + shift) for which each anchor of a group keeps the class that classifyGroup() gave it;
// 0 for those it left open. `slacks` has room for lanes.count, rounded up to 16.
void laneSlacks(const EyeClassifier& eye, const CutScales& scales, const LodClassifier& lod, const GroupLanes& lanes,
                float* slacks);

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
        const CutMotion& motion = m_eyes[eye].poses.motion(entry.pose);
        return motion.turn > 0 || motion.shift > 0;
    }

    [[nodiscard]] const CutScales& scales(uint32_t eye) const { return m_eyes[eye].poses.scales(); }
    [[nodiscard]] uint64_t bytes() const; // none before begin()

private:
    struct Eye {
        std::vector<CutEntry> chunks, groups;
        CutPoses poses;
    };

    [[nodiscard]] static const CutEntry* find(const Eye& eye, const CutEntry& entry, uint32_t record)
    {
        if (eye.poses.now() - entry.pose >= cutLife(record))
            return nullptr;
        return eye.poses.motion(entry.pose).within(entry.slack, entry.reach) ? &entry : nullptr;
    }
    template <typename Record>
    void keep(Eye& eye, CutEntry& entry, const Record& record, float slack) const;

    const ModelView* m_model = nullptr;
    Eye m_eyes[kMaxEyes];
};

} // namespace gsc
