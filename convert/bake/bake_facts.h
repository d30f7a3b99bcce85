// SPDX-License-Identifier: Apache-2.0
// All that the measurements of a bake depend on, as lines that a person reads and two bakes compare.
#pragma once

#include "convert/bake/bake.h"
#include "convert/bake/pictures/pose_sets.h"
#include <gsc/gsc_reader.h>
#include <gsc/renderer.h>

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Lines "name: value", none with a line end. `targets`: of a curve, or empty. Precondition: `view` came from openGsc() with
// GscCheck::Full, so that its header stands for all of its bytes. Threads are left out: no measurement depends on them.
[[nodiscard]] std::vector<std::string> bakeFacts(const BakeOptions& options, std::span<const double> targets,
                                                 const GscView& view, const PoseSets& poses, const Renderer& renderer);

} // namespace gsc
