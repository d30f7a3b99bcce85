// SPDX-License-Identifier: Apache-2.0
// The details that `gsc bake --curve` times a model with.
#pragma once

namespace gsc {

constexpr unsigned kTimedDetails[] = {0, 1, 2, 4}; // pixels, of --detail

} // namespace gsc
