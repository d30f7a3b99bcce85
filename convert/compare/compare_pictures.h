// SPDX-License-Identifier: Apache-2.0
// `gsc compare-pictures`: pictures of one folder against those of another.
#pragma once

#include "convert/compare/picture_set.h"
#include "runtime/cli/reporter.h"

#include <string>

namespace gsc {

// Each picture of `reference` against the one of `pictures` with the same name; extensions may differ. Both are folders,
// of which files that are no pictures are left out, or both are files. A warning counts the pictures that only
// `pictures` has: they are not compared. Throws Error: Io for what is not found, InvalidFile for a picture of another
// size, two of one name or a folder without a picture, Unsupported.
PictureSet comparePictures(const std::string& reference, const std::string& pictures, const Lpips* lpips,
                           Reporter& report);

} // namespace gsc
