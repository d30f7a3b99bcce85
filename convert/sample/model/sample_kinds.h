// SPDX-License-Identifier: Apache-2.0
// The kinds of scenes and models that `gsc sample` makes.
#pragma once

namespace gsc {

enum class SampleScene { City, Street, Room };
enum class SampleModel { Scaffold, Octree };

} // namespace gsc
