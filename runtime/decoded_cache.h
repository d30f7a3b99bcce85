// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians kept across frames, on a CPU (design section 5, cache "decoded").
#pragma once

#include "kernels/common/buffer.h"
#include "kernels/decode/decode.h"
#include "kernels/schedule/schedule.h"

#include <memory>
#include <vector>

namespace gsc {

constexpr uint32_t kNoSlot = ~0u;

// A strip as one camera centre saw it. Its Gaussians keep the opacity before the factor of the level, so that an anchor
// that fades is not decoded again; those below 1/255 are left out, since no factor is above one.
struct CacheEntry {
    float center[3] = {}; // decoded from here
    uint32_t strip = 0, eye = 0;
    uint64_t decoded = 0, used = 0; // frames
    uint32_t count = 0;             // Gaussians
    bool any_positive = false;
    bool valid = false;
};

// Slots of equal size in slabs that never move. An entry belongs to one strip and one eye, but any eye may draw it.
// Not thread-safe, but different entries may be filled and read at the same time.
class DecodedCache {
public:
    void load(const ModelParams& params); // forgets everything and fits the slots to the model
    void clear();

    // Of strip `strip` decoded for `eye`, or kNoSlot.
    [[nodiscard]] uint32_t find(uint64_t strip, uint32_t eye) const { return m_slot_of[eye][strip]; }
    [[nodiscard]] CacheEntry& entry(uint32_t slot) { return m_entries[slot]; }
    [[nodiscard]] const CacheEntry& entry(uint32_t slot) const { return m_entries[slot]; }

    // Where the Gaussians of a slot lie; origins are those of the group (anchor in group * K + k).
    [[nodiscard]] GaussianBlock block(uint32_t slot) const;

    // Makes room for `wanted` more entries without passing `limit` bytes in all (0 = none): grows, then gives up the
    // entries that were used least recently, never one used in `frame`. Returns how many add() calls will succeed.
    size_t makeRoom(size_t wanted, uint64_t limit, uint64_t frame);
    uint32_t add(uint64_t strip, uint32_t eye);                      // precondition: room
    [[nodiscard]] uint64_t evictions() const { return m_evictions; } // since load()
    [[nodiscard]] uint64_t bytes() const;

private:
    static constexpr uint32_t kSlabSlots = 64;
    void grow(size_t slots);
    void release(uint32_t slot);

    size_t m_capacity = 0;   // Gaussians of a slot's arrays, with the vector that a compressed store may add
    size_t m_slot_bytes = 0; // arrays of a slot
    std::vector<uint32_t> m_slot_of[kMaxEyes]; // per strip
    std::vector<CacheEntry> m_entries;         // per slot
    std::vector<uint32_t> m_free;
    std::vector<std::unique_ptr<Buffer<std::byte>>> m_slabs;
    uint64_t m_evictions = 0;
};

} // namespace gsc
