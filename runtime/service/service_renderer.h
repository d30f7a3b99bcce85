// SPDX-License-Identifier: Apache-2.0
// Several renderers as one: what plays, measures or compares with a Renderer does so with a service.
#pragma once

#include "runtime/service/renderer_service.h"

namespace gsc {

class ServiceRenderer : public Renderer {
public:
    [[nodiscard]] virtual ServiceStats stats() const = 0;
    [[nodiscard]] virtual ServiceTrace trace() const = 0;
};

// Renderer::framesInFlight() of a service of so many devices.
uint32_t serviceFramesInFlight(size_t devices);

// load() starts the service; what it throws, that throws. Every frame is drawn, and pictures come in order
// (ServiceOptions::keeps_all, whatever `options` say). Targets are in memory of this process or there are none, all of a
// frame of one format; without targets pictures are gathered as Rgba8 in memory of the first worker's device.
std::unique_ptr<ServiceRenderer> makeServiceRenderer(const ServiceOptions& options);

} // namespace gsc
