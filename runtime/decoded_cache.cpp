// SPDX-License-Identifier: Apache-2.0
#include "runtime/decoded_cache.h"

#include <algorithm>

namespace gsc {

namespace {

constexpr size_t kFloatArrays = 14; // of a GaussianBlock

} // namespace

void DecodedCache::load(const ModelParams& params)
{
    // every array starts on a vector; a compressed store may write a whole vector past the last value
    m_capacity = size_t(kStripAnchors) * params.n_offsets + kMaxLanes;
    const size_t origin_bytes = (m_capacity * sizeof(uint16_t) + 63) / 64 * 64;
    m_slot_bytes = kFloatArrays * m_capacity * sizeof(float) + origin_bytes;
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
    for (size_t slot = m_entries.size(); slot-- > 0;)
        m_free.push_back(uint32_t(slot));
    for (CacheEntry& entry : m_entries)
        entry.valid = false;
}

GaussianBlock DecodedCache::block(uint32_t slot) const
{
    std::byte* memory = m_slabs[slot / kSlabSlots]->data() + slot % kSlabSlots * m_slot_bytes;
    float* values = reinterpret_cast<float*>(memory);
    const auto take = [&values, this] {
        float* p = values;
        values += m_capacity;
        return p;
    };
    GaussianBlock block{};
    for (int i = 0; i < 3; ++i) {
        block.position[i] = take();
        block.scale[i] = take();
        block.color[i] = take();
    }
    for (float*& p : block.rotation)
        p = take();
    block.opacity = take();
    block.origin = reinterpret_cast<uint16_t*>(values);
    block.count = m_entries[slot].count;
    block.any_positive = m_entries[slot].any_positive;
    return block;
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
    const uint64_t slab_bytes = kSlabSlots * m_slot_bytes;
    const uint64_t most_slabs = limit == 0 ? UINT32_MAX / kSlabSlots : limit / slab_bytes;
    const size_t room = m_slabs.size() < most_slabs ? size_t(most_slabs - m_slabs.size()) * kSlabSlots : 0;
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
