// SPDX-License-Identifier: Apache-2.0
// A model in device memory: flat arrays in half precision for the matrix units, and, once a frame asks for them, the
// chunk arrays as in the file for the scalar decode.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/decode/exact/decode_exact_cuda.h"
#include "kernels/upload/upload_cuda.h"
#include "runtime/cuda/device/chunk_reader.h"
#include "runtime/cuda/device/device_buffer.h"

#include <memory>

namespace gsc {

class DeviceScene {
public:
    // `threads` threads read the model's file; 0 = as many as are useful.
    DeviceScene(MemoryBudget& budget, int threads)
        : m_threads(threads), m_flat(budget), m_staging(budget), m_exact(budget), m_origins(budget)
    {
    }

    // `model` must outlive this object or the next load(). All functions throw Error (OutOfMemory, Unsupported,
    // Device).
    void load(const ModelView& model, const CudaStream& stream);
    // Loads everything but the anchors, which bring() loads. Throws as load() does.
    void loadFrame(const ModelView& model, const CudaStream& stream);
    void forget() // call after a load() that failed: there is no model then
    {
        m_reader.reset();
        m_host = {};
    }
    // Returns true if all anchors are on the device.
    [[nodiscard]] bool whole() const { return m_runs_there == m_model.run_count; }
    // Uploads chunks that have been read, until `end` has passed or none has arrived for `patience`. The order was
    // fixed by the `eye` of the first call: coarse levels first, near chunks before far ones, those behind the eye
    // last.
    void bring(const EyeParams& eye, ChunkReader::Clock::time_point end, ChunkReader::Clock::duration patience);
    // runsThere(): number of group runs, from the first on, whose anchors are on the device. anchorsAbsent(): number
    // of anchors that are not.
    [[nodiscard]] uint32_t runsThere() const { return m_runs_there; }
    [[nodiscard]] uint64_t anchorsAbsent() const { return m_anchors - m_anchors_there; }
    // Loads everything that decode_exact reads, unless that is done. Waits until the whole file is read.
    void loadExact(const CudaStream& stream);
    // Loads origins(), for false colours, unless that is done.
    void loadOrigins(const CudaStream& stream);
    // Computes the weights of both tiers for a row of the appearance embedding. Precondition: fastPossible().
    void useAppearance(int32_t appearance, const CudaStream& stream);

    [[nodiscard]] const DeviceModel& model() const { return m_model; }
    [[nodiscard]] const ModelView& host() const { return m_host; }
    // holds device pointers, after loadExact()
    [[nodiscard]] const ModelView& exactView() const { return m_exact_view; }
    [[nodiscard]] bool exactLoaded() const { return m_exact_loaded; }
    // For each source index: kGroupSize x its group + its place in the group. Null before loadOrigins().
    [[nodiscard]] const uint32_t* origins() const { return reinterpret_cast<const uint32_t*>(m_origins.get()); }
    [[nodiscard]] bool fastPossible() const { return m_fast_possible; }
    // true if one of the networks takes this input (MlpInputs)
    [[nodiscard]] bool takes(uint32_t input) const { return (m_inputs & input) != 0; }
    [[nodiscard]] const uint16_t* fragments() const { return m_fragments; }
    [[nodiscard]] const float* biases() const { return m_biases; }
    [[nodiscard]] const float* bank() const { return m_bank; } // weights of the feature bank; null: the model has none
    // weights for tier exact; null: the networks do not fit the kernels that use tiles
    [[nodiscard]] const ExactWeights* exactWeights() const { return m_weights; }

private:
    struct FlatArrays;
    FlatArrays layOutFlat(ArenaLayout& layout, uint64_t anchors, size_t runs) const;
    void beginReading(const std::vector<uint32_t>& chunks);
    const CudaStream& upload(const ChunkPiece& piece);
    void waitForUploads() const;
    void endReading();
    void checkNumbers(uint32_t last_source) const; // checks the anchors' source indices; throws Error(Unsupported)

    int m_threads;
    uint64_t m_anchors = 0, m_anchors_there = 0;
    uint32_t m_runs_there = 0;
    // pieces use these two in turn, so that one is converted while the next is copied; frames are drawn meanwhile
    struct Way {
        CudaStream stream;
        unsigned char* piece = nullptr; // piece of a chunk on its way, in m_staging
    };
    Way m_ways[2];
    uint32_t m_way = 0;
    ModelView m_host{};
    DeviceModel m_model{};
    bool m_fast_possible = false, m_exact_loaded = false;
    uint32_t m_inputs = 0;
    int32_t m_appearance = 0; // row of the embedding that m_fragments was computed for
    bool m_weights_ready = false;

    // the flat arrays; pieces of chunks on their way into them; weights for decode_exact; origins()
    DeviceArena m_flat, m_staging, m_exact, m_origins;
    AnchorArrays m_to{};
    GroupRun* m_runs = nullptr;
    uint16_t* m_fragments = nullptr;
    float *m_biases = nullptr, *m_bank = nullptr;
    ExactWeights* m_weights = nullptr;
    ModelView m_exact_view{};

    // not null while anchors are being loaded; declared last, because its threads use the members above
    std::unique_ptr<ChunkReader> m_reader;
};

} // namespace gsc
