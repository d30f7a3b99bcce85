// SPDX-License-Identifier: Apache-2.0
#include "convert/write/scan.h"

#include "format/numbers/count_text.h"
#include "convert/write/anchor_check.h"
#include "convert/write/batch_stream.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace gsc {

namespace {

constexpr uint64_t kSampleRows = 100'000; // rows sampled evenly from the whole file
// first rows of each level, which are sampled too, so that a small level is not missed
constexpr uint64_t kSamplesPerLevel = 4096;

struct FaultCount {
    uint64_t count = 0, first = 0;
};

class Scanner {
public:
    Scanner(const Checkpoint& checkpoint, bool drop_invalid, uint64_t placement_bytes, ScanResult& result)
        : m_checkpoint(checkpoint), m_drop_invalid(drop_invalid), m_result(result)
    {
        m_stride = std::max<uint64_t>(1, checkpoint.anchor_count / kSampleRows);
        m_keep_placements = checkpoint.anchor_count <= placement_bytes / sizeof(ScannedPlace);
        if (m_keep_placements)
            result.placements.reserve(checkpoint.anchor_count);
    }

    void add(const AnchorBatch& batch)
    {
        for (size_t i = 0; i < batch.count; ++i) {
            const AnchorFault fault = findAnchorFault(batch, i, m_checkpoint.feat_dim, m_checkpoint.n_offsets,
                                                      (m_checkpoint.flags & kModelMaskedSlots) != 0);
            if (fault != AnchorFault::None) {
                FaultCount& seen = m_faults[size_t(fault)];
                if (seen.count++ == 0)
                    seen.first = batch.first + i;
                if (m_drop_invalid)
                    m_result.dropped.push_back(batch.first + i);
                continue;
            }
            addPlacement(batch, i);
            addConstants(batch, i);
            ++m_result.kept;
        }
        m_result.rows += batch.count;
    }

    void finish()
    {
        std::string text;
        uint64_t invalid = 0;
        for (size_t f = 1; f < m_faults.size(); ++f)
            if (m_faults[f].count) {
                invalid += m_faults[f].count;
                text += formatString("%s%llu with %s (first: anchor %llu)", text.empty() ? "" : ", ",
                                     (unsigned long long)m_faults[f].count, kAnchorFaultTexts[f],
                                     (unsigned long long)m_faults[f].first);
            }
        const char* name = m_checkpoint.ply_path.c_str();
        if (m_result.rows != m_checkpoint.anchor_count)
            throw Error(ErrorCode::InvalidFile, name, "holds " + formatCount(m_result.rows, "anchor"),
                        formatCount(m_checkpoint.anchor_count) + " as its header says",
                        "it is truncated or was changed while being read");
        if (invalid && !m_drop_invalid)
            throw Error(ErrorCode::InvalidFile, name,
                        formatString("%s of %s cannot be shown: %s", formatCount(invalid).c_str(),
                                     formatCount(m_result.rows, "anchor").c_str(), text.c_str()),
                        "finite values", "pass --drop-invalid to leave them out");
        if (m_result.kept == 0)
            throw Error(ErrorCode::InvalidFile, name, "has no anchor that can be shown", "at least one",
                        "train the model again");
        if (invalid)
            m_result.warnings.push_back(formatString("%s of %s were left out: %s; source indices count "
                                                     "the remaining anchors",
                                                     formatCount(invalid).c_str(),
                                                     formatCount(m_result.rows, "anchor").c_str(), text.c_str()));
    }

private:
    void addPlacement(const AnchorBatch& batch, size_t i)
    {
        ScannedPlace placement;
        std::copy_n(&batch.position[3 * i], 3, placement.position);
        placement.level = batch.level[i];
        if (!m_level || placement.level != m_level->level) {
            m_level = &m_result.levels[placement.level];
            m_level->level = placement.level;
        }
        for (int axis = 0; axis < 3; ++axis) {
            const float p = placement.position[axis];
            m_level->bounds_min[axis] = m_level->anchor_count ? std::min(m_level->bounds_min[axis], p) : p;
            m_level->bounds_max[axis] = m_level->anchor_count ? std::max(m_level->bounds_max[axis], p) : p;
        }
        if ((batch.first + i) % m_stride == 0 || m_level->anchor_count < kSamplesPerLevel)
            for (const float p : placement.position)
                m_result.samples.push_back({p, placement.level});
        ++m_level->anchor_count;
        if (m_keep_placements)
            m_result.placements.push_back(placement);
    }

    // Compares rotation, opacity and normal with those of the first anchor bit for bit, so -0.0 and +0.0 differ.
    void addConstants(const AnchorBatch& batch, size_t i)
    {
        static constexpr float kZero[3] = {0, 0, 0};
        if (m_result.kept == 0) {
            std::copy_n(&batch.rotation[4 * i], 4, m_result.rotation);
            m_result.opacity = batch.opacity[i];
        }
        if (std::memcmp(&batch.rotation[4 * i], m_result.rotation, sizeof(m_result.rotation)) != 0)
            m_result.varying |= kModelHasRotation;
        if (std::memcmp(&batch.opacity[i], &m_result.opacity, sizeof(float)) != 0)
            m_result.varying |= kModelHasOpacity;
        if (std::memcmp(&batch.normal[3 * i], kZero, sizeof(kZero)) != 0)
            m_result.varying |= kModelHasNormal;
    }

    const Checkpoint& m_checkpoint;
    const bool m_drop_invalid;
    ScanResult& m_result;
    uint64_t m_stride = 1;
    bool m_keep_placements = false;
    LevelRecord* m_level = nullptr; // record of the level of the last anchor
    std::array<FaultCount, size_t(AnchorFault::Count)> m_faults{};
};

} // namespace

ScanResult scanAnchors(AnchorSource& source, const Checkpoint& checkpoint, bool drop_invalid, uint64_t placement_bytes,
                       const std::function<void(uint64_t)>& progress)
{
    ScanResult result;
    Scanner scanner(checkpoint, drop_invalid, placement_bytes, result);
    forEachBatch(source, kAnchorAll, [&](const AnchorBatch& batch) {
        scanner.add(batch);
        progress(result.rows);
    });
    scanner.finish();
    return result;
}

void forEachPlacement(AnchorSource& source, const ScanResult& scan,
                      const std::function<void(std::span<const ScannedPlace>)>& work)
{
    if (!scan.placements.empty()) {
        const std::span<const ScannedPlace> all(scan.placements);
        for (size_t first = 0; first < all.size(); first += kBatchRows) {
            throwIfInterrupted();
            work(all.subspan(first, std::min(kBatchRows, all.size() - first)));
        }
        return;
    }
    DroppedRows dropped(scan.dropped);
    std::vector<ScannedPlace> kept;
    forEachBatch(source, kAnchorPlacement, [&](const AnchorBatch& batch) {
        kept.clear();
        for (size_t i = 0; i < batch.count; ++i)
            if (!dropped.isDropped(batch.first + i))
                kept.push_back(
                    {{batch.position[3 * i], batch.position[3 * i + 1], batch.position[3 * i + 2]}, batch.level[i]});
        work(kept);
    });
}

} // namespace gsc
