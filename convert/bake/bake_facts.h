// SPDX-License-Identifier: Apache-2.0
// Everything that a bake's measurements depend on, as readable lines: equal lines, equal measurements.
#pragma once

#include "convert/bake/bake.h"
#include "convert/bake/pictures/pose_sets.h"
#include <gsc/gsc_reader.h>
#include <gsc/renderer.h>

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Lines "name: value", without line ends. `targets`: those of a curve, or empty. Precondition: `view` came from openGsc()
// with GscCheck::Full, so that its header's checksums are those of its bytes. No measurement depends on threads, so they are
// left out.
[[nodiscard]] std::vector<std::string> bakeFacts(const BakeOptions& options, std::span<const double> targets,
                                                 const GscView& view, const PoseSets& poses, const Renderer& renderer);

} // namespace gsc
