// SPDX-License-Identifier: Apache-2.0
// Decoded Gaussians kept across frames, on a CPU (design section 5, cache "decoded").
#pragma once

#include "kernels/reuse/packed_strip.h"

#include <memory>
#include <vector>

namespace gsc {

constexpr uint32_t kNoSlot = ~0u;

// A strip decoded at one or two camera centres (keys).
struct CacheEntry {
    StripKeys keys;
    uint32_t strip = 0, eye = 0;
    uint64_t decoded = 0, used = 0; // frames; decoded: the last key
    PackedExtent extent = {};       // extent of the packed strip
    float cover = 0; // largest share of the picture that one of its Gaussians covered when last drawn, see broadShare()
    bool valid = false;
};

// Slots of equal size in slabs that never move. An entry belongs to one strip and one eye, but any eye may draw it.
// Not thread-safe, but different entries may be filled and read at the same time.
class DecodedCache {
public:
    void load(const ModelParams& params); // forgets everything and fits the slots to the model
    void clear();                         // forgets everything and gives the memory back
    // Gives up entries until the rest takes at most `limit` bytes (0 = no limit); also those in a slab that a lower limit
    // has cut short. Called before any entry of a frame is looked up.
    void shrink(uint64_t limit);

    // Slot of strip `strip` decoded for `eye`, or kNoSlot.
    [[nodiscard]] uint32_t find(uint32_t strip, uint32_t eye) const { return m_slot_of[eye][strip]; }
    [[nodiscard]] CacheEntry& entry(uint32_t slot) { return m_entries[slot]; }
    [[nodiscard]] const CacheEntry& entry(uint32_t slot) const { return m_entries[slot]; }

    // Packed strip of a slot, for drawing (packed_strip.h); its last key unpacked (strip.h), which a refresh starts from.
    [[nodiscard]] std::byte* packed(uint32_t slot) const;
    [[nodiscard]] uint16_t* lastKey(uint32_t slot) const;

    // Makes room for `wanted` more entries without passing `limit` bytes in all (0 = none): grows, then gives up the
    // entries that were used least recently, never one used in `frame`. Returns how many add() calls will succeed.
    size_t makeRoom(size_t wanted, uint64_t limit, uint64_t frame);
    uint32_t add(uint32_t strip, uint32_t eye);                      // precondition: room
    [[nodiscard]] uint64_t evictions() const { return m_evictions; } // since load()
    [[nodiscard]] uint64_t bytes() const;

private:
    struct Slab {
        std::unique_ptr<std::byte, FreeMemory> data;
        uint32_t slots;
    };
    [[nodiscard]] size_t mostSlots(uint64_t limit) const;
    [[nodiscard]] size_t slabBytes(uint32_t slots) const;
    void grow(size_t slots, size_t most);
    void release(uint32_t slot);

    size_t m_packed_bytes = 0, m_slot_bytes = 0;
    uint32_t m_slab_slots = 1;                 // slots of every slab but the last, which a limit may cut short
    std::vector<uint32_t> m_slot_of[kMaxEyes]; // per strip
    std::vector<CacheEntry> m_entries;         // per slot
    std::vector<uint32_t> m_free;
    std::vector<Slab> m_slabs;
    uint64_t m_evictions = 0;
};

} // namespace gsc
