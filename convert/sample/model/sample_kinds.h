// SPDX-License-Identifier: Apache-2.0
// Kinds of samples.
#pragma once

namespace gsc {

enum class SampleScene { City, Street, Room };
enum class SampleModel { Scaffold, Octree };

} // namespace gsc
