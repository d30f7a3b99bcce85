// SPDX-License-Identifier: Apache-2.0
// A model in device memory: flat arrays in half precision for the matrix units, and the chunk arrays as they lie in
// the file for the scalar decode, those only once a frame asks for them.
#pragma once

#include "kernels/frame/device_model.h"
#include "kernels/decode/decode_exact_cuda.h"
#include "runtime/cuda/cuda_device.h"
#include "runtime/cuda/device_buffer.h"

namespace gsc {

struct AnchorArrays;

class DeviceScene {
public:
    explicit DeviceScene(MemoryBudget& budget) : m_flat(budget), m_staging(budget), m_exact(budget), m_origins(budget)
    {
    }

    // `model` must outlive this or the next load(). Throws Error (OutOfMemory, Unsupported, Device), as all do.
    void load(const ModelView& model, const CudaStream& stream);
    void forget() { m_host = {}; } // after a load() that failed: there is no model
    // Everything decode_exact reads; does nothing the second time.
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
    void uploadChunks(const AnchorArrays& to, const CudaStream& stream);
    void copyArrays(uint64_t chunk, const ChunkArrayLayout& layout, unsigned char* to, const CudaStream& stream) const;

    ModelView m_host{};
    DeviceModel m_model{};
    bool m_fast_possible = false, m_exact_loaded = false;
    uint32_t m_inputs = 0;
    int32_t m_appearance = 0; // of m_fragments
    bool m_weights_ready = false;

    // the flat arrays, chunk arrays on their way into them, what decode_exact reads, and origins()
    DeviceArena m_flat, m_staging, m_exact, m_origins;
    uint16_t* m_fragments = nullptr;
    float *m_biases = nullptr, *m_bank = nullptr;
    ExactWeights* m_weights = nullptr;
    ModelView m_exact_view{};
};

} // namespace gsc
