// SPDX-License-Identifier: Apache-2.0
// Poses for tests of a renderer service, and what one renderer draws of them.
#pragma once

#include "runtime/service/renderer_service.h"
#include "tests/backends/reuse_scene.h"

#include <map>

namespace gsc::test {

// Workers on the host, of one thread each.
inline ServiceOptions cpuWorkers(size_t count, ServiceMode mode)
{
    ServiceOptions options;
    options.devices.assign(count, DeviceId{"cpu"});
    options.renderer.threads = 1;
    options.mode = mode;
    options.keeps_all = true;
    return options;
}

// The pictures of pose `i`, both eyes one after the other, as one renderer draws them.
inline std::vector<unsigned char> expectedBytes(Renderer& renderer, int i, size_t eye_count,
                                                const FrameOptions& options)
{
    const std::vector<EyeParams> eyes = walk(i, eye_count);
    std::vector<unsigned char> all;
    for (const Image<float>& image : render(renderer, eyes, options)) {
        const auto rows = inTarget(image.pixels, eyes[0].width, PixelFormat::Rgba8, eyes[0].width * size_t(4), 0);
        all.insert(all.end(), rows.begin(), rows.end());
    }
    return all;
}

inline std::vector<unsigned char> bytesOf(const Delivery& delivery, int i, size_t eye_count)
{
    const std::vector<EyeParams> eyes = walk(i, eye_count);
    std::vector<unsigned char> all;
    for (size_t e = 0; e < eye_count; ++e) {
        const auto* const pixels = static_cast<const unsigned char*>(delivery.eyes[e].pixels);
        all.insert(all.end(), pixels, pixels + size_t(4) * eyes[e].width * eyes[e].height);
    }
    return all;
}

inline uint64_t submitWalk(RendererService& service, int i, size_t eye_count, const FrameOptions& options)
{
    const std::vector<EyeParams> eyes = walk(i, eye_count);
    PoseRequest request;
    request.eyes = eyes;
    request.options = options;
    return service.submit(request);
}

} // namespace gsc::test
