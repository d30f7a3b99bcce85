// SPDX-License-Identifier: Apache-2.0
// Chunks of a mapped file on their way to a device. Threads copy them into page-locked memory, some pieces ahead of the
// device, which takes them from there in order. The driver's own copy from pageable memory reads with one thread.
#pragma once

#include "runtime/cuda/device/cuda_device.h"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace gsc {

// Consecutive anchors of one chunk.
struct ChunkPiece {
    uint64_t chunk;
    uint32_t first, count; // anchors, from the chunk's first
    uint32_t last_source;  // the largest of their source indices
    ChunkArrayLayout layout;
    const unsigned char* bytes; // their arrays by `layout`, those up to Rotation; page-locked
};

// Used from one thread, on one device.
class ChunkReader {
public:
    using Clock = std::chrono::steady_clock;

    // Reads the chunks of `model`, which outlives this, in the order of `chunks`. `threads`: 0 chooses the number. Throws
    // Error (OutOfMemory, Device).
    ChunkReader(const ModelView& model, const std::vector<uint32_t>& chunks, int threads);
    ~ChunkReader(); // waits for copies to the device that are under way
    ChunkReader(const ChunkReader&) = delete;
    ChunkReader& operator=(const ChunkReader&) = delete;

    // Most bytes of a piece.
    [[nodiscard]] static size_t pieceBytes(const ModelView& model);

    // Calls take(piece) for pieces in their order, until `end` has passed or none has come for `patience`. It enqueues work
    // that may read the piece's bytes until it is done, and returns the stream. True when the last piece is taken.
    template <typename Take>
    bool some(Clock::time_point end, Clock::duration patience, const Take& take)
    {
        while (m_taken < m_pieces.size()) {
            if (!waitForNext(end, patience))
                return false;
            taken(take(static_cast<const ChunkPiece&>(m_pieces[m_taken])));
        }
        return true;
    }

    // some() for all pieces: waits as long as it takes.
    template <typename Take>
    void all(const Take& take)
    {
        (void)some(Clock::time_point::max(), {}, take);
    }

private:
    struct Slot {
        unsigned char* bytes = nullptr;
        std::unique_ptr<CudaEvent> passed; // the device has copied its bytes
        size_t filled = 0;                 // 1 + the piece that lies in it
    };

    bool waitForNext(Clock::time_point end, Clock::duration patience);
    void taken(const CudaStream& stream);
    void read();
    void fill(ChunkPiece& piece, unsigned char* to) const;
    Slot& slotOf(size_t piece) { return m_slots[piece % m_slots.size()]; }

    const ModelView& m_model;
    std::vector<ChunkPiece> m_pieces;
    std::shared_ptr<unsigned char> m_memory;
    std::vector<Slot> m_slots;
    size_t m_taken = 0; // pieces

    std::mutex m_mutex; // guards the members below, and Slot::filled
    std::condition_variable m_changed;
    size_t m_next = 0;  // piece that a thread reads next
    size_t m_freed = 0; // pieces whose slots may be filled again
    bool m_stopped = false;
    std::vector<std::jthread> m_threads; // declared last: they end before the members that they use
};

} // namespace gsc
