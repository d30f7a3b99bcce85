// SPDX-License-Identifier: Apache-2.0
// Makes a service of several renderers usable as one Renderer.
#pragma once

#include "runtime/service/renderer_service.h"

namespace gsc {

class ServiceRenderer : public Renderer {
public:
    [[nodiscard]] virtual ServiceStats stats() const = 0;
    [[nodiscard]] virtual ServiceTrace trace() const = 0;
};

// Returns Renderer::framesInFlight() of a service with this number of devices.
uint32_t serviceFramesInFlight(size_t devices);

// Makes the renderer. load() starts the service, and throws as its constructor does. Every frame is drawn, and
// pictures come in order: ServiceOptions::keeps_all is set, whatever `options` say. All targets of a frame must have
// one format and lie in memory of this process; without targets, pictures are collected as Rgba8 in memory of the
// first worker's device.
std::unique_ptr<ServiceRenderer> makeServiceRenderer(const ServiceOptions& options);

} // namespace gsc
