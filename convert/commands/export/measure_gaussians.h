// SPDX-License-Identifier: Apache-2.0
// Measures how pictures of exported Gaussians differ from those of tier `exact`, and chooses levels by it.
#pragma once

#include "convert/commands/export/export_gaussians.h"
#include "convert/export/gaussian_set.h"
#include <gsc/error.h>
#include "runtime/frames/shot.h"

#include <memory>
#include <new>
#include <vector>

namespace gsc {

// Returns false if memory is too short for `measure`, which only measures: then its numbers are missing.
template <typename Measure>
bool ifMemoryHolds(Measure&& measure)
{
    try {
        measure();
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    } catch (const Error& e) {
        if (e.code() != ErrorCode::OutOfMemory)
            throw;
        return false;
    }
}

// Draws `judges` both ways.
GaussianLoss lossOf(const GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<Shot>& judges,
                    int threads, Reporter& report);

// Keeps the Gaussians of the choice.
void keepLevels(GaussianSet& set, const LevelSet& choice);

// Measures what small pictures from some of `views` lose with each choice worth trying; the first is all Gaussians.
// Precondition: `set` is not empty and has levels.
std::vector<LevelTrial> tryLevels(GaussianSet& set, const std::shared_ptr<const Scene>& scene,
                                  const std::vector<Shot>& views, int threads, Reporter& report);

} // namespace gsc
