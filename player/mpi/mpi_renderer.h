// SPDX-License-Identifier: Apache-2.0
// Renderers in other MPI ranks, for a service in rank 0, and the loop that those ranks run.
#pragma once

#include "player/devices/worker_options.h"
#include <gsc/renderer.h>

#include <memory>

namespace gsc {

// Makes a renderer in rank `rank`, on backend `backend`, that loads the model from the same path there. load() throws
// Error(Usage) if that file is not the same. Pictures come in memory of this process. Each renderer is used from one
// thread at a time; several can be used at once.
std::unique_ptr<Renderer> makeMpiRenderer(int rank, const ModelChoice& model, const std::string& backend,
                                          const RendererOptions& limits);

WireBytes wireBytes();

// Draws the frames that rank 0 asks for, until rank 0 asks to quit. Called by every rank but 0. `on_machine` is the
// rank's number among the ranks of its machine, by which it chooses one of the GPUs.
void serveRank(int on_machine);
void endRanks(); // called by rank 0: ends serveRank() in all others
// Returns true if a thread still waits for another rank after all renderers should have ended: then only MPI_Abort()
// can end the job.
bool ranksHang();

} // namespace gsc
