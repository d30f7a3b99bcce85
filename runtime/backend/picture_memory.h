// SPDX-License-Identifier: Apache-2.0
// Memory that pictures are delivered in, and how workers bring theirs there.
#pragma once

#include <gsc/renderer.h>

#include <map>
#include <mutex>
#include <vector>

namespace gsc {

// A source of memory for pictures. May be used from any thread; memory that take() gave returns when its last user
// drops it, and may outlive this.
class PictureMemory {
public:
    virtual ~PictureMemory() = default;

    [[nodiscard]] virtual FrameTarget::Kind kind() const = 0; // kind of targets in it: Host or Device

    // At least `bytes`; content undefined. Throws Error (OutOfMemory, Device).
    virtual std::shared_ptr<std::byte> take(size_t bytes) = 0;

    // True if this renderer can draw into the memory itself.
    [[nodiscard]] virtual bool takesFrom(const Renderer& renderer) const = 0;

    // True if its device is lost: all its memory is then useless, and none of it is freed.
    virtual bool lost() { return false; }
};

// Rows of bytes, in memory of a picture.
struct PicturePart {
    size_t offset = 0, pitch = 0; // offset of the first row; bytes from row to row
    size_t bytes = 0, rows = 0;   // bytes of a row; rows
};

// A worker's way of delivering pictures into memory that its renderer cannot draw into. Used from the worker's thread.
class PictureBridge {
public:
    virtual ~PictureBridge() = default;

    // Memory of `bytes` bytes that the renderer can draw into, in `slot`, which nothing else uses until finish().
    // Throws as take().
    virtual FrameTarget buffer(uint32_t slot, size_t bytes) = 0;

    // Begins to copy a part of the buffer to the same place of the picture. Throws Error(Device), as finish() does.
    virtual void land(uint32_t slot, std::byte* picture, const PicturePart& part) = 0;
    virtual void finish() = 0; // waits until all are there
};

// Whole pages of this process; `place` is ignored. Throws Error(OutOfMemory).
std::byte* allocatePages(size_t bytes, int place);
void freePages(std::byte* block, int place);

// Recycles blocks of memory by their size.
class BlockPool : public std::enable_shared_from_this<BlockPool> {
public:
    using Allocate = std::byte* (*)(size_t bytes, int place);
    using Free = void (*)(std::byte* block, int place);

    BlockPool(Allocate allocate, Free free, int place) : m_allocate(allocate), m_free(free), m_place(place) {}
    ~BlockPool();
    BlockPool(const BlockPool&) = delete;
    BlockPool& operator=(const BlockPool&) = delete;

    std::shared_ptr<std::byte> take(size_t bytes);
    void forget(); // a reset has freed all blocks, and others may lie there now

private:
    void giveBack(std::byte* block, size_t bytes);

    Allocate m_allocate;
    Free m_free;
    int m_place;
    std::mutex m_mutex; // guards the members below
    bool m_forgotten = false;
    std::multimap<size_t, std::byte*> m_spare; // key: bytes
    size_t m_spare_bytes = 0;
};

} // namespace gsc
