// SPDX-License-Identifier: Apache-2.0
// `gsc compare-pictures`: compares the pictures of two folders, or two pictures.
#pragma once

#include "convert/compare/picture_set.h"
#include "runtime/cli/reporter.h"

#include <string>

namespace gsc {

// Compares each picture of `reference` with the picture of the same name in `pictures`; extensions may differ. Either
// both are folders, in which other files are ignored, or both are files. A warning tells how many pictures only
// `pictures` has; they are not compared. Throws Error: Io for what is not found; InvalidFile for a picture of another
// size, two pictures of one name, or a folder without pictures; Unsupported.
PictureSet comparePictures(const std::string& reference, const std::string& pictures, const Lpips* lpips,
                           Reporter& report);

} // namespace gsc
