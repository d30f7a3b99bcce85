// SPDX-License-Identifier: Apache-2.0
// Hashes of a model and of poses, which tell runs apart.
#pragma once

#include <gsc/checksum.h>
#include "player/frames/shots.h"

#include <span>
#include <string>

namespace gsc {

// Every pose as the backend gets it.
void addPoses(std::span<const Shot> shots, uint32_t eye_count, Checksum64& sum);

// The checksum of header and section table, which holds those of everything else. Precondition: Scene::open() took the
// file. Throws Error(Io).
uint64_t fileHash(const std::string& path);

} // namespace gsc
