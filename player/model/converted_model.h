// SPDX-License-Identifier: Apache-2.0
// Trained models in place of a .gsc: the program gsc, of which gsc-play links nothing, converts them.
#pragma once

#include "runtime/cli/reporter.h"

#include <string>

namespace gsc {

// Converts `model`, if it is a trained model, into a temporary .gsc that lies there until this program ends. Warnings
// and progress are those of `gsc convert`; so is the Error that is thrown if it fails. Does nothing the second time.
void convertModel(const std::string& model, Reporter& log);

// Returns the path of the .gsc that stands for `model`: what convertModel() made, or else `model` itself.
std::string gscPath(const std::string& model);

} // namespace gsc
