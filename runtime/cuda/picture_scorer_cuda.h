// SPDX-License-Identifier: Apache-2.0
// Scores of pictures on a GPU: those of the host's scorer, computed where the pictures are.
#pragma once

#include "runtime/metrics/picture_scorer.h"

namespace gsc {

// Takes pictures in memory of device `ordinal`, and of this process, which it copies. Throws Error(Device).
std::unique_ptr<PictureScorer> makeCudaScorer(int ordinal);

uint64_t freeCudaBytes(int ordinal); // free device memory now. Throws Error(Device)

} // namespace gsc
