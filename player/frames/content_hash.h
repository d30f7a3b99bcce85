// SPDX-License-Identifier: Apache-2.0
// Checksums of a model and of poses, by which runs on different models or poses are told apart.
#pragma once

#include <gsc/checksum.h>
#include "player/frames/shots.h"

#include <span>
#include <string>

namespace gsc {

// Adds every pose to `sum`, as the backend gets it.
void addPoses(std::span<const Shot> shots, uint32_t eye_count, Checksum64& sum);

// Checksum of the header and the section table of a .gsc file, or of the one that stands for a trained model; these
// hold the checksums of everything else in it. Precondition: openScene() took the file. Throws Error(Io).
uint64_t fileHash(const std::string& path);

} // namespace gsc
