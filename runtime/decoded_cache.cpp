// SPDX-License-Identifier: Apache-2.0
#include "runtime/decoded_cache.h"

#include <algorithm>

namespace gsc {

void DecodedCache::load(const ModelParams& params)
{
    m_fixed_bytes = stripFixedValues(params.n_offsets) * sizeof(float);
    m_key_bytes = stripKeyValues(params.n_offsets) * sizeof(uint16_t);
    m_slot_bytes = (m_fixed_bytes + 2 * m_key_bytes + 63) / 64 * 64; // slots start on a cache line
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

size_t DecodedCache::mostSlabs(uint64_t limit) const
{
    return limit == 0 ? UINT32_MAX / kSlabSlots : size_t(limit / (kSlabSlots * m_slot_bytes));
}

void DecodedCache::shrink(uint64_t limit)
{
    const size_t most = mostSlabs(limit);
    if (m_slabs.size() <= most)
        return;
    const auto first = uint32_t(most * kSlabSlots);
    for (uint32_t slot = first; slot < m_entries.size(); ++slot)
        if (m_entries[slot].valid) {
            release(slot);
            ++m_evictions;
        }
    std::erase_if(m_free, [first](uint32_t slot) { return slot >= first; });
    m_entries.resize(first);
    m_slabs.resize(most);
}

float* DecodedCache::fixed(uint32_t slot) const
{
    return reinterpret_cast<float*>(m_slabs[slot / kSlabSlots]->data() + slot % kSlabSlots * m_slot_bytes);
}

uint16_t* DecodedCache::key(uint32_t slot, uint32_t key) const
{
    return reinterpret_cast<uint16_t*>(reinterpret_cast<std::byte*>(fixed(slot)) + m_fixed_bytes + key * m_key_bytes);
}

void DecodedCache::grow(size_t slots)
{
    while (m_free.size() < slots) {
        auto slab = std::make_unique<Buffer<std::byte>>();
        slab->reserveExactly(kSlabSlots * m_slot_bytes);
        m_slabs.push_back(std::move(slab));
        const size_t first = m_entries.size();
        m_entries.resize(first + kSlabSlots);
        for (size_t slot = first + kSlabSlots; slot-- > first;)
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
    const size_t most_slabs = mostSlabs(limit);
    const size_t room = m_slabs.size() < most_slabs ? (most_slabs - m_slabs.size()) * kSlabSlots : 0;
    const size_t missing = wanted > m_free.size() ? wanted - m_free.size() : 0;
    grow(m_free.size() + std::min(missing, room));
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
    std::sort(old.begin(), old.begin() + ptrdiff_t(victims)); // so that the slots handed out next do not depend on it
    for (size_t i = 0; i < victims; ++i)
        release(old[i]);
    m_evictions += victims;
    return m_free.size();
}

uint32_t DecodedCache::add(uint64_t strip, uint32_t eye)
{
    const uint32_t slot = m_free.back();
    m_free.pop_back();
    m_entries[slot] = {};
    m_entries[slot].strip = uint32_t(strip);
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
    return bytes + m_slabs.size() * kSlabSlots * m_slot_bytes;
}

} // namespace gsc
