// SPDX-License-Identifier: Apache-2.0
// The weights of LPIPS from the files their authors publish; gsc carries none.
#pragma once

#include "runtime/metrics/lpips.h"

#include <string>

namespace gsc {

// `backbone`: a state dictionary of torchvision's VGG16, of which features.N.weight and features.N.bias are read.
// `heads`: lin0.model.1.weight to lin4.model.1.weight, as in PerceptualSimilarity's weights/v0.1/vgg.pth.
// Both are what torch.save wrote, before or since PyTorch 1.6. Throws Error: Io, InvalidFile, Unsupported.
LpipsWeights readLpipsWeights(const std::string& backbone, const std::string& heads);

} // namespace gsc
