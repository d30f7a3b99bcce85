// SPDX-License-Identifier: Apache-2.0
// A model in device memory: flat arrays in half precision for the matrix units, and the chunk arrays as they lie in
// the file for the scalar decode, those only once a frame asks for them.
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
    // `threads` read the model's file, 0 chooses the number.
    DeviceScene(MemoryBudget& budget, int threads)
        : m_threads(threads), m_flat(budget), m_staging(budget), m_exact(budget), m_origins(budget)
    {
    }

    // `model` must outlive this or the next load(). Throws Error (OutOfMemory, Unsupported, Device), as all do.
    void load(const ModelView& model, const CudaStream& stream);
    // Loads all but the anchors, which bring() brings. Throws as load().
    void loadFrame(const ModelView& model, const CudaStream& stream);
    void forget() // after a load() that failed: there is no model
    {
        m_reader.reset();
        m_host = {};
    }
    // True if all anchors are on the device.
    [[nodiscard]] bool whole() const { return m_runs_there == m_model.run_count; }
    // Brings chunks that have been read, until `end` has passed or none has come for `patience`; those behind `eye` last,
    // coarse levels first, near ones before far ones: as the first call found it.
    void bring(const EyeParams& eye, ChunkReader::Clock::time_point end, ChunkReader::Clock::duration patience);
    // Runs of groups whose anchors are there, from the first on, and how many anchors are in none of them.
    [[nodiscard]] uint32_t runsThere() const { return m_runs_there; }
    [[nodiscard]] uint64_t anchorsAbsent() const { return m_anchors - m_anchors_there; }
    // Everything decode_exact reads; does nothing the second time. Waits for the file.
    void loadExact(const CudaStream& stream);
    // origins(), for false colours; does nothing the second time.
    void loadOrigins(const CudaStream& stream);
    // Weights of both tiers with the row of the embedding folded in. Precondition: fastPossible().
    void useAppearance(int32_t appearance, const CudaStream& stream);

    [[nodiscard]] const DeviceModel& model() const { return m_model; }
    [[nodiscard]] const ModelView& host() const { return m_host; }
    [[nodiscard]] const ModelView& exactView() const { return m_exact_view; } // device pointers; after loadExact()
    [[nodiscard]] bool exactLoaded() const { return m_exact_loaded; }
    // Per source index: kGroupSize x its group + its place there. Null before loadOrigins().
    [[nodiscard]] const uint32_t* origins() const { return reinterpret_cast<const uint32_t*>(m_origins.get()); }
    [[nodiscard]] bool fastPossible() const { return m_fast_possible; }
    [[nodiscard]] bool takes(uint32_t input) const { return (m_inputs & input) != 0; } // MlpInputs of any network
    [[nodiscard]] const uint16_t* fragments() const { return m_fragments; }
    [[nodiscard]] const float* biases() const { return m_biases; }
    [[nodiscard]] const float* bank() const { return m_bank; }                   // null: the model has none
    [[nodiscard]] const ExactWeights* exactWeights() const { return m_weights; } // null: not for the tiles

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
    // pieces take these in turns, so that one is converted while the next is copied; frames go on meanwhile
    struct Way {
        CudaStream stream;
        unsigned char* piece = nullptr; // in m_staging
    };
    Way m_ways[2];
    uint32_t m_way = 0;
    ModelView m_host{};
    DeviceModel m_model{};
    bool m_fast_possible = false, m_exact_loaded = false;
    uint32_t m_inputs = 0;
    int32_t m_appearance = 0; // appearance that m_fragments holds
    bool m_weights_ready = false;

    // the flat arrays, parts of chunk arrays on their way into them, weights of decode_exact, and origins()
    DeviceArena m_flat, m_staging, m_exact, m_origins;
    AnchorArrays m_to{};
    GroupRun* m_runs = nullptr;
    uint16_t* m_fragments = nullptr;
    float *m_biases = nullptr, *m_bank = nullptr;
    ExactWeights* m_weights = nullptr;
    ModelView m_exact_view{};

    // set while anchors come; declared last: it goes before the members that its threads use
    std::unique_ptr<ChunkReader> m_reader;
};

} // namespace gsc
