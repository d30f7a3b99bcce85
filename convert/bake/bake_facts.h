// SPDX-License-Identifier: Apache-2.0
// Lists as text all that the measurements of a bake depend on: two bakes with equal lines measure the same.
#pragma once

#include "convert/bake/bake.h"
#include "convert/bake/pictures/pose_sets.h"
#include <gsc/gsc_reader.h>
#include <gsc/renderer.h>

#include <span>
#include <string>
#include <vector>

namespace gsc {

// Returns lines "name: value" without line ends. `targets`: those of a curve, or empty. Precondition: `view` came from
// openGsc() with GscCheck::Full, so that the checksums in its header are those of its bytes. The number of threads is
// not listed, because no measurement depends on it.
[[nodiscard]] std::vector<std::string> bakeFacts(const BakeOptions& options, std::span<const double> targets,
                                                 const GscView& view, const PoseSets& poses, const Renderer& renderer);

} // namespace gsc
