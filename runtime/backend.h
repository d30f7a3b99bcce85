// SPDX-License-Identifier: Apache-2.0
// What a device must do to play a model. One instance owns its copy of what it needs and its frame buffers; it is
// used from one thread at a time.
#pragma once

#include "kernels/common/frame_types.h"

#include <memory>
#include <string>
#include <vector>

namespace gsc {

class Backend {
public:
    virtual ~Backend() = default;

    [[nodiscard]] virtual const char* name() const = 0;

    // What a frame asked for in tier `asked` is rendered in.
    [[nodiscard]] virtual Tier tierOf(Tier asked) const = 0;

    // `model` and everything it points to must outlive the backend or the next load().
    // Throws Error (OutOfMemory, Unsupported, Device).
    virtual void load(const ModelView& model) = 0;

    // Renders `eye_count` (1 or 2) eyes into `images`: per eye height x width x 3 floats, interleaved RGB, row 0 on
    // top, unclamped. Buffers grow as needed; a second frame of the same load allocates nothing.
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
// "auto" takes the first. Throws Error(Usage) for a name that is not listed, naming those that are.
std::unique_ptr<Backend> makeBackend(const std::string& name, int threads);

} // namespace gsc
