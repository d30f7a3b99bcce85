// SPDX-License-Identifier: Apache-2.0
// View sensitivities of a model whose file has none.
#pragma once

#include <gsc/frame_types.h>
#include "kernels/threads/parallel.h"

#include <vector>

namespace gsc {

// Computes ModelView::sensitivity: two halves per anchor in file order, computed as the converter does, for the first
// row of the appearance embedding.
std::vector<uint16_t> modelSensitivity(const ModelView& model, const Workers& workers);

} // namespace gsc
