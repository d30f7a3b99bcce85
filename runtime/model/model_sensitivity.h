// SPDX-License-Identifier: Apache-2.0
// Computes the view sensitivities of a model whose file has none.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/threads/parallel.h"

#include <vector>

namespace gsc {

// Returns ModelView::sensitivity: two halves for each anchor, in file order, computed as the converter does for the
// first row of the appearance embedding.
std::vector<uint16_t> modelSensitivity(const ModelView& model, const Workers& workers);

} // namespace gsc
