// SPDX-License-Identifier: Apache-2.0
#include "runtime/reuse/decoded_cache.h"

#include <gsc/error.h>

#include <algorithm>
#include <cstdlib>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace gsc {

namespace {

// Size of a slab. The strips of a frame lie all over the cache; with pages of 4 KiB each strip would cost two or three
// walks through the page tables, which take as long as reading the strip.
constexpr size_t kHugePage = size_t(2) << 20;

} // namespace

void DecodedCache::load(const ModelParams& params)
{
    m_packed_bytes = packedStripBytes(params.n_offsets);
    m_slot_bytes = m_packed_bytes + stripKeyValues(params.n_offsets) * sizeof(uint16_t);
    m_slab_slots = uint32_t(std::max<size_t>(1, kHugePage / m_slot_bytes));
    m_slabs.clear();
    m_entries.clear();
    m_free.clear();
    m_evictions = 0;
    for (auto& slots : m_slot_of)
        slots.assign(size_t(params.group_count) * kStripsPerGroup, kNoSlot);
}

void DecodedCache::clear()
{
    for (auto& slots : m_slot_of)
        std::fill(slots.begin(), slots.end(), kNoSlot);
    m_free.clear();
    m_entries.clear();
    m_slabs.clear();
}

size_t DecodedCache::mostSlots(uint64_t limit) const
{
    const uint64_t rest = std::min<uint64_t>(limit % kHugePage / m_slot_bytes, m_slab_slots - 1);
    const uint64_t slots = limit / kHugePage * m_slab_slots + rest;
    return limit == 0 ? kNoSlot : size_t(std::min<uint64_t>(slots, kNoSlot));
}

void DecodedCache::shrink(uint64_t limit)
{
    const size_t most = mostSlots(limit);
    const auto cut_short = [this] { return !m_slabs.empty() && m_slabs.back().slots < m_slab_slots; };
    while (m_entries.size() > most || (m_entries.size() < most && cut_short())) {
        const size_t first = m_entries.size() - m_slabs.back().slots;
        for (size_t slot = first; slot < m_entries.size(); ++slot)
            if (m_entries[slot].valid) {
                release(uint32_t(slot));
                ++m_evictions;
            }
        std::erase_if(m_free, [first](uint32_t slot) { return slot >= first; });
        m_entries.resize(first);
        m_slabs.pop_back();
    }
}

// Address of a slot's packed strip. A slab holds the packed strips of its slots first, then their last keys, which
// drawing does not read.
std::byte* DecodedCache::packed(uint32_t slot) const
{
    return m_slabs[slot / m_slab_slots].data.get() + slot % m_slab_slots * m_packed_bytes;
}

uint16_t* DecodedCache::lastKey(uint32_t slot) const
{
    const Slab& slab = m_slabs[slot / m_slab_slots];
    const size_t at = slab.slots * m_packed_bytes + slot % m_slab_slots * (m_slot_bytes - m_packed_bytes);
    return reinterpret_cast<uint16_t*>(slab.data.get() + at);
}

size_t DecodedCache::slabBytes(uint32_t slots) const
{
    return slots == m_slab_slots ? kHugePage : (slots * m_slot_bytes + 63) / 64 * 64;
}

// Adds slabs until `slots` slots are free, or there are `most` slots in all.
void DecodedCache::grow(size_t slots, size_t most)
{
    while (m_free.size() < slots && m_entries.size() < most) {
        const size_t first = m_entries.size();
        Slab slab{nullptr, uint32_t(std::min<size_t>(m_slab_slots, most - first))};
        const bool huge = slab.slots == m_slab_slots;
        const size_t bytes = slabBytes(slab.slots);
        slab.data.reset(static_cast<std::byte*>(std::aligned_alloc(huge ? kHugePage : 64, bytes)));
        if (slab.data == nullptr)
            throw Error(ErrorCode::OutOfMemory, "cache of decoded Gaussians",
                        formatString("no memory for %zu bytes", bytes), "enough", "lower the budget of the cache")
                .with({Setting::CacheMemory});
#ifdef __linux__
        if (huge)
            (void)madvise(slab.data.get(), bytes, MADV_HUGEPAGE); // only advice: failure costs time, nothing else
#endif
        m_slabs.push_back(std::move(slab));
        m_entries.resize(first + m_slabs.back().slots);
        for (size_t slot = m_entries.size(); slot-- > first;)
            m_free.push_back(uint32_t(slot));
    }
}

void DecodedCache::release(uint32_t slot)
{
    CacheEntry& entry = m_entries[slot];
    m_slot_of[entry.eye][entry.strip] = kNoSlot;
    entry.valid = false;
    m_free.push_back(slot);
}

size_t DecodedCache::makeRoom(size_t wanted, uint64_t limit, uint64_t frame)
{
    grow(wanted, mostSlots(limit));
    if (m_free.size() >= wanted)
        return wanted;
    std::vector<uint32_t> old;
    for (uint32_t slot = 0; slot < m_entries.size(); ++slot)
        if (m_entries[slot].valid && m_entries[slot].used < frame)
            old.push_back(slot);
    const size_t victims = std::min(old.size(), wanted - m_free.size());
    const auto older = [this](uint32_t a, uint32_t b) {
        return m_entries[a].used != m_entries[b].used ? m_entries[a].used < m_entries[b].used : a < b;
    };
    std::nth_element(old.begin(), old.begin() + ptrdiff_t(victims), old.end(), older);
    // sorted, so that the order in which slots are used again does not depend on nth_element
    std::sort(old.begin(), old.begin() + ptrdiff_t(victims));
    for (size_t i = 0; i < victims; ++i)
        release(old[i]);
    m_evictions += victims;
    return m_free.size();
}

uint32_t DecodedCache::add(uint32_t strip, uint32_t eye)
{
    const uint32_t slot = m_free.back();
    m_free.pop_back();
    m_entries[slot] = {};
    m_entries[slot].strip = strip;
    m_entries[slot].eye = eye;
    m_entries[slot].valid = true;
    m_slot_of[eye][strip] = slot;
    return slot;
}

uint64_t DecodedCache::bytes() const
{
    uint64_t bytes = m_entries.capacity() * sizeof(CacheEntry) + m_free.capacity() * sizeof(uint32_t);
    for (const auto& slots : m_slot_of)
        bytes += slots.capacity() * sizeof(uint32_t);
    for (const Slab& slab : m_slabs)
        bytes += slabBytes(slab.slots);
    return bytes;
}

} // namespace gsc
