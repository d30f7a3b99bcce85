// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device/chunk_reader.h"

#include "format/machine/threads.h"

#include <algorithm>
#include <cstring>
#include <system_error>

namespace gsc {

namespace {

constexpr size_t kPieceBytes = 2 << 20; // a piece is copied in 40 us, much longer than the launches between copies take
constexpr int kMostThreads = 8; // eight threads read 41 GB/s from the page cache of an H200's host; more are no faster
constexpr size_t kSlotsPerThread = 2;

// Layout of the arrays that a frame reads. Arrays behind Rotation only record what the checkpoint held, and are left
// out.
ChunkArrayLayout layoutOf(ModelParams params, uint32_t anchors)
{
    params.flags &= ~uint32_t(kModelHasOpacity | kModelHasNormal);
    return chunkArrayLayout(params, anchors);
}

uint32_t pieceAnchors(const ModelParams& params)
{
    const uint64_t group = layoutOf(params, kGroupSize).bytes;
    return uint32_t(std::max<uint64_t>(kPieceBytes / group, 1)) * kGroupSize;
}

} // namespace

size_t ChunkReader::pieceBytes(const ModelView& model)
{
    uint32_t largest = 0; // largest source index in the chunk
    for (uint64_t c = 0; c < model.params->chunk_count; ++c)
        largest = std::max(largest, model.chunks[c].anchor_count);
    const uint32_t anchors = std::min(largest, pieceAnchors(*model.params));
    return alignUp(std::max<uint64_t>(layoutOf(*model.params, anchors).bytes, 1), kPayloadAlign);
}

ChunkReader::ChunkReader(const ModelView& model, const std::vector<uint32_t>& chunks, int threads) : m_model(model)
{
    const uint32_t most = pieceAnchors(*model.params);
    for (const uint32_t c : chunks)
        for (uint32_t first = 0; first < model.chunks[c].anchor_count; first += most) {
            const uint32_t count = std::min(most, model.chunks[c].anchor_count - first);
            m_pieces.push_back({c, first, count, 0, layoutOf(*model.params, count), nullptr});
        }
    if (m_pieces.empty())
        return;
    const int cores = poolThreads(threads);
    const size_t readers = std::min<size_t>(size_t(std::min(cores, kMostThreads)), m_pieces.size());
    m_slots.resize(std::min(readers * kSlotsPerThread, m_pieces.size()));
    const size_t bytes = pieceBytes(model);
    unsigned char* memory = nullptr;
    GSC_CUDA_CHECK(cudaMallocHost(reinterpret_cast<void**>(&memory), bytes * m_slots.size()));
    m_memory = {memory, [](unsigned char* p) { cudaFreeHost(p); }};
    for (size_t s = 0; s < m_slots.size(); ++s) {
        m_slots[s].bytes = memory + s * bytes;
        m_slots[s].passed = std::make_unique<CudaEvent>();
    }
    m_threads.reserve(readers);
    const ThreadAttempt attempt;
    try {
        for (size_t t = 0; t < readers; ++t)
            m_threads.emplace_back([this] { read(); });
    } catch (const std::system_error&) {
        if (m_threads.empty()) // with fewer threads reading is only slower
            throw tooFewThreads("cuda");
    }
}

ChunkReader::~ChunkReader()
{
    {
        const std::lock_guard lock(m_mutex);
        m_stopped = true;
    }
    m_changed.notify_all();
    for (const Slot& slot : m_slots) // after a failed load the device may still read from slots
        (void)cudaEventSynchronize(slot.passed->handle);
}

bool ChunkReader::waitForNext(Clock::time_point end, Clock::duration patience)
{
    std::unique_lock lock(m_mutex);
    const auto come = [&] { return slotOf(m_taken).filled == m_taken + 1; };
    if (end == Clock::time_point::max()) {
        m_changed.wait(lock, come);
        return true;
    }
    const Clock::time_point now = Clock::now();
    return now < end && m_changed.wait_until(lock, std::min(end, now + patience), come);
}

void ChunkReader::taken(const CudaStream& stream)
{
    slotOf(m_taken).passed->record(stream);
    // the device may use half of the slots while the threads fill the others
    if (++m_taken < m_freed + (m_slots.size() + 1) / 2)
        return;
    GSC_CUDA_CHECK(cudaEventSynchronize(slotOf(m_freed).passed->handle));
    {
        const std::lock_guard lock(m_mutex);
        ++m_freed;
    }
    m_changed.notify_all();
}

void ChunkReader::read()
{
    std::unique_lock lock(m_mutex);
    while (m_next < m_pieces.size()) {
        const size_t piece = m_next++;
        m_changed.wait(lock, [&] { return m_stopped || piece < m_freed + m_slots.size(); });
        if (m_stopped)
            return;
        lock.unlock();
        fill(m_pieces[piece], slotOf(piece).bytes);
        lock.lock();
        slotOf(piece).filled = piece + 1;
        m_changed.notify_all();
    }
}

void ChunkReader::fill(ChunkPiece& piece, unsigned char* to) const
{
    const ChunkArrays& arrays = m_model.arrays[piece.chunk];
    const void* position = arrays.grid_position;
    if (position == nullptr)
        position = arrays.float_position;
    // in the order of enum ChunkArray
    const void* const from[] = {position,      arrays.source_index, arrays.extra_level, arrays.scale,
                                arrays.offset, arrays.feature,      arrays.rotation};
    for (size_t a = 0; a < std::size(from); ++a)
        if (const uint64_t stride = piece.layout.stride[a]; stride != 0)
            std::memcpy(to + piece.layout.offset[a], static_cast<const unsigned char*>(from[a]) + stride * piece.first,
                        stride * piece.count);
    const auto* sources =
        reinterpret_cast<const uint32_t*>(to + piece.layout.offset[uint32_t(ChunkArray::SourceIndex)]);
    piece.last_source = *std::max_element(sources, sources + piece.count);
    piece.bytes = to;
}

} // namespace gsc
