// SPDX-License-Identifier: Apache-2.0
// Memory that pictures are delivered in, and the ways by which workers deliver them.
#pragma once

#include <gsc/renderer.h>

#include <map>
#include <mutex>
#include <vector>

namespace gsc {

// A source of memory for pictures. May be used from any thread. Memory of take() returns here when its last user drops
// it, and may outlive this object.
class PictureMemory {
public:
    virtual ~PictureMemory() = default;

    [[nodiscard]] virtual FrameTarget::Kind kind() const = 0; // kind of target that the memory makes: Host or Device

    // Returns at least `bytes` of memory with undefined content. Throws Error (OutOfMemory, Device).
    virtual std::shared_ptr<std::byte> take(size_t bytes) = 0;

    // Returns true if this renderer can draw into the memory itself.
    [[nodiscard]] virtual bool takesFrom(const Renderer& renderer) const = 0;

    // Returns true if the device of this memory is lost: all of the memory is then useless, and none of it is freed.
    virtual bool lost() { return false; }
};

// A rectangle of pixels in a picture's memory, as rows of bytes.
struct PicturePart {
    size_t offset = 0, pitch = 0; // offset of the first row, and distance from one row to the next, in bytes
    size_t bytes = 0, rows = 0;   // bytes of pixels in each row; number of rows
};

// Delivers a worker's pictures into memory that the worker's renderer cannot draw into. Used from the worker's thread.
class PictureBridge {
public:
    virtual ~PictureBridge() = default;

    // Returns memory of `bytes` bytes that the renderer can draw into. Nothing else uses memory of the same `slot`
    // until finish(). Throws as PictureMemory::take() does.
    virtual FrameTarget buffer(uint32_t slot, size_t bytes) = 0;

    // Begins to copy a part of the buffer of `slot` to the same place in `picture`. Throws Error(Device), as finish()
    // does.
    virtual void land(uint32_t slot, std::byte* picture, const PicturePart& part) = 0;
    virtual void finish() = 0; // waits until all copies have ended
};

// Allocates whole pages of this process's memory; `place` is ignored. Throws Error(OutOfMemory).
std::byte* allocatePages(size_t bytes, int place);
void freePages(std::byte* block, int place);

// Keeps freed blocks of memory by their size, to use them again.
class BlockPool : public std::enable_shared_from_this<BlockPool> {
public:
    using Allocate = std::byte* (*)(size_t bytes, int place);
    using Free = void (*)(std::byte* block, int place);

    BlockPool(Allocate allocate, Free free, int place) : m_allocate(allocate), m_free(free), m_place(place) {}
    ~BlockPool();
    BlockPool(const BlockPool&) = delete;
    BlockPool& operator=(const BlockPool&) = delete;

    std::shared_ptr<std::byte> take(size_t bytes);
    void forget(); // call after a reset of the device: it has freed all blocks, and other memory may lie there now

private:
    void giveBack(std::byte* block, size_t bytes);

    Allocate m_allocate;
    Free m_free;
    int m_place;
    std::mutex m_mutex; // guards the members below
    bool m_forgotten = false;
    std::multimap<size_t, std::byte*> m_spare; // spare blocks, sorted by their size in bytes
    size_t m_spare_bytes = 0;
};

} // namespace gsc
