// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/bake/bake.h"

namespace gsc {

// bake() with the anchors of `source` instead of those of the checkpoint's PLY. If ply_path and weight_paths are
// empty the source hash is that of nothing.
BakeReport bakeFrom(const Checkpoint& checkpoint, AnchorSource& source, const BakeOptions& options,
                    const BakeProgress& progress);

} // namespace gsc
