// SPDX-License-Identifier: Apache-2.0
// What a device must do to play a model. One instance owns its copy of what it needs and its frame buffers; it is
// used from one thread at a time.
#pragma once

#include "kernels/frame/frame_types.h"

#include <memory>
#include <string>
#include <vector>

namespace gsc {

// What a measurement must state about where it was taken. Empty or 0 = unknown.
struct DeviceFacts {
    std::string name, driver;
    uint64_t memory_bytes = 0;
    uint32_t processors = 0;                    // multiprocessors of a GPU, threads of a CPU
    double clock_mhz = 0, memory_clock_mhz = 0; // at the moment of asking
    uint64_t context_bytes = 0;                 // of its memory that the driver takes for this process
};

// The most of each kind of work that a device does, each measured alone. A multiply-add is one lane operation and two
// FLOP.
struct DeviceCeilings {
    double copy_bytes_per_s = 0;   // device memory, bytes read and bytes written together
    double read_bytes_per_s = 0;   // device memory
    double fma_lane_ops_per_s = 0; // fp32
    double mma_flop_per_s = 0;     // matrix units through mma.sync, factors of fp16 and sums of fp32
    double exp_per_s = 0;          // base 2, approximate

    [[nodiscard]] bool known() const { return copy_bytes_per_s > 0; } // then all are
};

class Backend {
public:
    virtual ~Backend() = default;

    [[nodiscard]] virtual const char* name() const = 0;
    [[nodiscard]] virtual DeviceFacts device() const = 0;

    // Measures them, which takes some tenths of a second and device memory. Unknown if the backend has no measurement.
    // Throws Error (OutOfMemory, Device).
    [[nodiscard]] virtual DeviceCeilings ceilings() { return {}; }

    // What a frame asked for in tier `asked` is rendered in.
    [[nodiscard]] virtual Tier tierOf(Tier asked) const = 0;

    // Most bytes of device memory that this process may take from now on, DeviceFacts::context_bytes included; 0 = all
    // there is. A renderer on the host takes no notice. Too few for the model make load() throw OutOfMemory; too few for a frame, render().
    virtual void setMemoryBudget(uint64_t) {}

    // `model` and everything it points to must outlive the backend or the next load().
    // Throws Error (OutOfMemory, Unsupported, Device).
    virtual void load(const ModelView& model) = 0;

    // Forgets what was kept from earlier frames, as if the next frame were the first.
    virtual void dropCaches() {}

    // Renders `eye_count` (1 or 2) eyes into `images`: per eye height x width x 3 floats, interleaved RGB, row 0 on
    // top, unclamped. `images` or an entry of it may be null: that image is rendered and stays on the device.
    // Buffers grow as needed; a second frame of the same load allocates nothing.
    virtual void render(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options, float* const* images,
                        FrameResult& result) = 0;
};

enum class CpuPath {
    Fast,      // SIMD, all threads
    Reference, // scalar float, one source with the kernels
};

// threads = 0 uses all cores. The CPU backend needs nothing but the machine.
std::unique_ptr<Backend> makeCpuBackend(CpuPath path, int threads);

struct BackendInfo {
    std::string name; // what --backend takes
    std::string description;
};

// Every backend this build and this machine can run, best first.
std::vector<BackendInfo> availableBackends();
// "auto" takes the first that the machine can run; `warning`, if not null, then says which better one it cannot and why.
// Throws Error: Usage for a name that this build does not have, naming those that it has; Device or Unsupported for one
// that this machine cannot run.
std::unique_ptr<Backend> makeBackend(const std::string& name, int threads, std::string* warning = nullptr);

} // namespace gsc
