// SPDX-License-Identifier: Apache-2.0
// Renderers on other ranks, for a service on rank 0, and the loop of those ranks.
#pragma once

#include "player/devices/worker_options.h"
#include <gsc/renderer.h>

#include <memory>

namespace gsc {

// A renderer that rank `rank` makes of `backend` and loads from the same path, which has to hold
// the same file there: load() throws Error(Usage) where it does not. Pictures come as memory of this process. Used from
// one thread at a time; several are used side by side.
std::unique_ptr<Renderer> makeMpiRenderer(int rank, const ModelChoice& model, const std::string& backend,
                                          const RendererOptions& limits);

WireBytes wireBytes();

// Draws the frames that rank 0 asks for, until it asks to quit. Called by every rank but 0.
// on_machine: the rank's number among those of its machine, which share its GPUs out.
void serveRank(int on_machine);
void endRanks(); // called by rank 0
// True if a thread still waits for another rank when all renderers should have gone: then only MPI_Abort() ends the
// job.
bool ranksHang();

} // namespace gsc
