// SPDX-License-Identifier: Apache-2.0
// Values of --detail with which `gsc bake --curve` times a model.
#pragma once

namespace gsc {

constexpr unsigned kTimedDetails[] = {0, 1, 2, 4}; // pixels

} // namespace gsc
