// SPDX-License-Identifier: Apache-2.0
#include "player/present/hand_over_ring.h"

#include <gsc/error.h>

namespace gsc {

namespace {

constexpr size_t kAlign = 256; // alignment in bytes of a picture in its block, enough for copies to images

size_t bytesOf(const ShownPicture& picture)
{
    return (size_t(picture.width) * picture.height * 4 + kAlign - 1) / kAlign * kAlign;
}

} // namespace

HandOverRing::HandOverRing(SharedMemory& memory, const DeviceId& device)
    : m_memory(memory), m_device(makeHandOver(device, memory.semaphoreFile()))
{
}

HandOverRing::~HandOverRing()
{
    m_device.reset(); // waits until the copies on the device have ended
    m_memory.importerGone();
    for (const SharedBlock& block : m_blocks)
        try {
            if (block.id != 0)
                m_memory.freeShared(block.id); // the block is freed once the display has read it
        } catch (const Error&) {               // a lost display frees nothing and reads nothing
        }
}

void HandOverRing::handOver(std::span<ShownPicture> pictures, std::span<const void* const> from)
{
    size_t bytes = 0;
    for (const ShownPicture& picture : pictures)
        bytes += bytesOf(picture);
    SharedBlock& block = m_blocks[m_next];
    m_next = (m_next + 1) % m_blocks.size();
    if (block.bytes < bytes) {
        if (block.id != 0) {
            m_device->dropBlock(block.id);
            m_memory.freeShared(block.id);
            block = {};
        }
        block = m_memory.makeShared(bytes);
        m_device->addBlock(block.id, block.file, block.bytes);
    }
    size_t offset = 0;
    ++m_value;
    for (size_t i = 0; i < pictures.size(); ++i) {
        ShownPicture& picture = pictures[i];
        m_device->copy(block.id, offset, from[i], size_t(picture.width) * picture.height * 4);
        picture.pixels = nullptr;
        picture.block = block.id;
        picture.offset = offset;
        picture.ready = m_value;
        offset += bytesOf(picture);
    }
    m_device->signal(m_value);
}

} // namespace gsc
