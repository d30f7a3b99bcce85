// SPDX-License-Identifier: Apache-2.0
// Gaussians kept across frames on a CPU (design section 5, cache "decoded").
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
    uint64_t decoded = 0, used = 0; // numbers of frames: when the last key was decoded; when the entry was drawn last
    PackedExtent extent = {};       // bytes of the packed strip that drawing reads, with one key and with two
    float cover = 0; // largest share of the picture that one of the Gaussians covered when last drawn, see broadShare()
    bool valid = false;
};

// Cache of entries in slots of equal size. Slots lie in slabs that never move. An entry belongs to one strip and one
// eye, but either eye may draw it. Not thread-safe, but different entries may be filled and read at the same time.
class DecodedCache {
public:
    void load(const ModelParams& params); // drops all entries, and sets the size of a slot for the model
    void clear();                         // drops all entries and frees the memory
    // Drops entries until the others take at most `limit` bytes (0 = no limit); also those in a slab that a lower
    // limit shortened. Call it before any entry of a frame is looked up.
    void shrink(uint64_t limit);

    // Returns the slot that holds strip `strip` decoded for `eye`, or kNoSlot.
    [[nodiscard]] uint32_t find(uint32_t strip, uint32_t eye) const { return m_slot_of[eye][strip]; }
    [[nodiscard]] CacheEntry& entry(uint32_t slot) { return m_entries[slot]; }
    [[nodiscard]] const CacheEntry& entry(uint32_t slot) const { return m_entries[slot]; }

    // packed(): the packed strip of a slot, for drawing (packed_strip.h). lastKey(): its last key, not packed
    // (strip.h), from which the next decode goes on.
    [[nodiscard]] std::byte* packed(uint32_t slot) const;
    [[nodiscard]] uint16_t* lastKey(uint32_t slot) const;

    // Makes room for `wanted` more entries within `limit` bytes in all (0 = no limit): adds slabs, then drops the
    // entries that were used least recently, but none used in frame `frame`. Returns the number of add() calls that
    // will succeed.
    size_t makeRoom(size_t wanted, uint64_t limit, uint64_t frame);
    // adds an entry and returns its slot; precondition: makeRoom() left room
    uint32_t add(uint32_t strip, uint32_t eye);
    [[nodiscard]] uint64_t evictions() const { return m_evictions; } // number of entries dropped since load()
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
    uint32_t m_slab_slots = 1;                 // slots of each slab; the last slab may have fewer because of a limit
    std::vector<uint32_t> m_slot_of[kMaxEyes]; // slot of each strip, for each eye
    std::vector<CacheEntry> m_entries;         // entry of each slot
    std::vector<uint32_t> m_free;
    std::vector<Slab> m_slabs;
    uint64_t m_evictions = 0;
};

} // namespace gsc
