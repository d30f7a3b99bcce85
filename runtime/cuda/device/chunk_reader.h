// SPDX-License-Identifier: Apache-2.0
// Reads chunks of a mapped file for a device. Threads copy them into page-locked memory, some pieces ahead; the device
// copies them from there in order. The driver's own copy from pageable memory would read with one thread.
#pragma once

#include "runtime/cuda/device/cuda_device.h"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace gsc {

// A piece of a chunk: consecutive anchors that are copied at once.
struct ChunkPiece {
    uint64_t chunk;
    uint32_t first, count; // number of the first anchor, from the chunk's first; number of anchors
    uint32_t last_source;  // largest source index of these anchors
    ChunkArrayLayout layout;
    const unsigned char* bytes; // arrays of these anchors up to Rotation, placed by `layout`, in page-locked memory
};

// Used from one thread, for one device.
class ChunkReader {
public:
    using Clock = std::chrono::steady_clock;

    // Reads the chunks of `model`, which must outlive this object, in the order of `chunks`, with `threads` threads; 0
    // = as many as are useful. Throws Error (OutOfMemory, Device).
    ChunkReader(const ModelView& model, const std::vector<uint32_t>& chunks, int threads);
    ~ChunkReader(); // waits for copies to the device that have not ended
    ChunkReader(const ChunkReader&) = delete;
    ChunkReader& operator=(const ChunkReader&) = delete;

    // Largest size of a piece in bytes.
    [[nodiscard]] static size_t pieceBytes(const ModelView& model);

    // Calls take(piece) for the next pieces in order, until `end` has passed or no piece has arrived for `patience`.
    // take() enqueues work that may read the piece's bytes, and returns the stream of that work. Returns true when the
    // last piece has been taken.
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

    // Does as some() for all remaining pieces, and waits as long as that takes.
    template <typename Take>
    void all(const Take& take)
    {
        (void)some(Clock::time_point::max(), {}, take);
    }

private:
    struct Slot {
        unsigned char* bytes = nullptr;
        std::unique_ptr<CudaEvent> passed; // passes when the device has copied the slot's bytes
        size_t filled = 0;                 // 1 + the number of the piece that lies in the slot
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
    size_t m_taken = 0; // number of pieces taken so far

    std::mutex m_mutex; // guards the members below, and Slot::filled
    std::condition_variable m_changed;
    size_t m_next = 0;  // number of the piece that a thread reads next
    size_t m_freed = 0; // number of pieces whose slots may be filled again
    bool m_stopped = false;
    std::vector<std::jthread> m_threads; // declared last, because the threads use the members above
};

} // namespace gsc
