// SPDX-License-Identifier: Apache-2.0
// Computes scores of pictures on a GPU, where the pictures are; the scores are those of the host's scorer.
#pragma once

#include "runtime/metrics/picture_scorer.h"

namespace gsc {

// Makes a scorer that takes pictures in memory of device `ordinal`, and of this process, which it copies there. Throws
// Error(Device).
std::unique_ptr<PictureScorer> makeCudaScorer(int ordinal);

uint64_t freeCudaBytes(int ordinal); // returns the free memory of a device in bytes. Throws Error(Device)

} // namespace gsc
