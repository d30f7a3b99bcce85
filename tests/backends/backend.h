// SPDX-License-Identifier: Apache-2.0
// The renderer that a program's cases are about. Cases in this folder are linked into two programs or more, once with
// on_cpu.cpp and once with on_cuda.cpp.
#pragma once

#include "tests/kernels/render_tools.h"

#include <memory>
#include <vector>

namespace gsc::test {

struct Backend {
    const char* name;                  // name for makeRenderer()
    const char* judge;                 // one that it is held to
    std::vector<Tier> tiers;           // tiers that it draws differently
    std::vector<ReusePolicy> policies; // policies that it has, without None
    double exact_db;                   // least PSNR of a frame against the judge, in the most precise tier
    double kept_db;                    // PSNR of what is drawn from half precision entries of this very frame
    double other_depths;               // share of pixels whose depth tier fast may take from another Gaussian
    uint64_t table_bytes;              // bytes of a cache beyond its limit: table of entries, histograms
    bool makes_all;                    // coarse copies that are due, in one frame
    int frames;                        // frames of a walk; an emulated device is slow
};
extern const Backend kBackend;

inline std::unique_ptr<Renderer> open(const ModelView& model, const DeviceId& device, const RendererOptions& options)
{
    std::unique_ptr<Renderer> renderer = makeRenderer(device, options);
    renderer->load(model);
    return renderer;
}
inline std::unique_ptr<Renderer> open(const ModelView& model, const char* name, int threads = 1)
{
    return open(model, DeviceId{name}, RendererOptions{threads});
}
inline std::unique_ptr<Renderer> open(const ModelView& model, int threads = 2)
{
    return open(model, kBackend.name, threads);
}

inline FrameOptions with(ReusePolicy policy, float bound = 0, uint32_t depth = 10)
{
    FrameOptions options = onGrey(Tier::Fast);
    options.reuse.policy = policy;
    options.reuse.bound = bound;
    options.reuse.max_depth = depth;
    return options;
}

// Every way to draw a frame: each tier, and each policy of reuse.
inline std::vector<FrameOptions> waysToDraw(float bound = 0, uint32_t depth = 3)
{
    std::vector<FrameOptions> ways;
    for (const Tier tier : kBackend.tiers)
        ways.push_back(onGrey(tier));
    for (const ReusePolicy policy : kBackend.policies)
        ways.push_back(with(policy, bound, depth));
    return ways;
}

// Everything a frame must hold: near the scalar reference, with its counts. One check per property, so that a failure says
// which. Defined beside the cases of frames that are of one backend alone. `exact_db`: least PSNR that the most
// precise tier must reach, 0 = kBackend.exact_db.
void checkFrame(const ModelView& model, const std::vector<EyeParams>& eyes, FrameOptions options, double exact_db = 0);

} // namespace gsc::test
