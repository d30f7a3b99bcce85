// SPDX-License-Identifier: Apache-2.0
// Reads the weights of LPIPS from the files that their authors publish; gsc contains none.
#pragma once

#include "runtime/metrics/lpips.h"

#include <string>

namespace gsc {

// `backbone`: the state dictionary of torchvision's VGG16, of which features.N.weight and features.N.bias are read.
// `heads`: file with lin0.model.1.weight to lin4.model.1.weight, such as weights/v0.1/vgg.pth of PerceptualSimilarity.
// Both may be written by torch.save before or since PyTorch 1.6. Throws Error: Io, InvalidFile, Unsupported.
LpipsWeights readLpipsWeights(const std::string& backbone, const std::string& heads);

} // namespace gsc
