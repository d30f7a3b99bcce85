// SPDX-License-Identifier: Apache-2.0
// Renderers of other ranks, for a service on rank 0, and what those ranks do.
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

// Of a rank that is not 0: draws what rank 0 asks for, until that is Quit.
// on_machine: its number among those of its machine, whose GPUs they share out.
void serveRank(int on_machine);
void endRanks(); // of rank 0
// Whether a thread still waits for another rank when all renderers should have gone: then only MPI_Abort() ends the
// job.
bool ranksHang();

} // namespace gsc
