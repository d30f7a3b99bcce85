// SPDX-License-Identifier: Apache-2.0
#include "runtime/backend/picture_memory.h"

#include <gsc/error.h>

#include <new>

namespace gsc {

namespace {

// Limits of the spare blocks that a pool keeps: their number; and their bytes, if there are more than kFewSpare.
constexpr size_t kMostSpare = 32, kFewSpare = 4, kSpareBytes = size_t(512) << 20;
constexpr std::align_val_t kPage{4096};

} // namespace

std::byte* allocatePages(size_t bytes, int)
{
    auto* const block = static_cast<std::byte*>(::operator new(bytes, kPage, std::nothrow));
    if (block == nullptr)
        throw Error(ErrorCode::OutOfMemory, "pictures", formatString("%zu bytes of memory are not there", bytes),
                    "enough", "draw smaller images")
            .with({Setting::ImageSize});
    return block;
}

void freePages(std::byte* block, int)
{
    ::operator delete(block, kPage);
}

void BlockPool::forget()
{
    const std::lock_guard lock(m_mutex);
    m_forgotten = true;
    m_spare.clear();
    m_spare_bytes = 0;
}

BlockPool::~BlockPool()
{
    for (const auto& [bytes, block] : m_spare)
        m_free(block, m_place);
}

std::shared_ptr<std::byte> BlockPool::take(size_t bytes)
{
    std::byte* block = nullptr;
    {
        const std::lock_guard lock(m_mutex);
        if (const auto found = m_spare.find(bytes); found != m_spare.end()) {
            block = found->second;
            m_spare.erase(found);
            m_spare_bytes -= bytes;
        }
    }
    if (block == nullptr)
        block = m_allocate(bytes, m_place);
    return {block, [pool = shared_from_this(), bytes](std::byte* given) { pool->giveBack(given, bytes); }};
}

// Keeps a block for later. If there are too many spare blocks, blocks of another size are freed first.
void BlockPool::giveBack(std::byte* block, size_t bytes)
{
    std::vector<std::byte*> dropped;
    {
        const std::lock_guard lock(m_mutex);
        if (m_forgotten)
            return;
        m_spare.emplace(bytes, block);
        m_spare_bytes += bytes;
        while (m_spare.size() > kMostSpare || (m_spare.size() > kFewSpare && m_spare_bytes > kSpareBytes)) {
            auto other = m_spare.begin();
            while (std::next(other) != m_spare.end() && other->first == bytes)
                ++other;
            dropped.push_back(other->second);
            m_spare_bytes -= other->first;
            m_spare.erase(other);
        }
    }
    for (std::byte* const old : dropped)
        m_free(old, m_place);
}

} // namespace gsc
