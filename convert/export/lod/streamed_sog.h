// SPDX-License-Identifier: Apache-2.0
// Streamed SOG, as splat-transform 3.7 writes and PlayCanvas 2.23 loads it: lod-meta.json, which has a tree of boxes, and a
// folder LEVEL_N for each chunk, a SOG that is not zipped. A leaf of the tree says, for each level that has Gaussians there,
// which run of which chunk they are.
#pragma once

#include "convert/export/lod/lod_model.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

constexpr const char* kLodMetaName = "lod-meta.json";
constexpr size_t kLodChunkGaussians = 1u << 17; // most Gaussians of a chunk, unless a single leaf has more

// Takes a file of the folder; `name` may have one folder before it. May throw.
using NamedFileSink = std::function<void(const std::string& name, std::span<const std::byte> content)>;
using LodProgress = std::function<void(uint64_t done, uint64_t all)>; // may throw

// `model` is of `set`. The number of each level's chunks is returned. Throws as writeGaussianSog(). The bytes do not depend on
// the number of threads.
std::vector<size_t> writeStreamedSog(const GaussianSet& set, const LodModel& model, const NamedFileSink& write,
                                     int threads, const LodProgress& progress);

using NamedFileReader = std::function<std::vector<std::byte>(const std::string& name)>;

// Gaussians as a viewer reads them of one level. `name` is used in messages. Throws Error(InvalidFile).
GaussianSet readStreamedSog(const NamedFileReader& read, size_t level, const std::string& name);

} // namespace gsc
