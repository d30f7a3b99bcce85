// SPDX-License-Identifier: Apache-2.0
// Writes streamed SOG as splat-transform 3.7 does and PlayCanvas 2.23 loads it. It is a folder with lod-meta.json,
// which has a tree of boxes, and with a folder LEVEL_N for each chunk, which holds the files of a SOG without the zip.
// A leaf of the tree tells for each level which range of which chunk holds its Gaussians.
#pragma once

#include "convert/export/lod/lod_model.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

constexpr const char* kLodMetaName = "lod-meta.json";
// most Gaussians of a chunk, unless a single leaf has more
constexpr size_t kLodChunkGaussians = 1u << 17;

// Takes a file of the folder. `name`: path in the folder, with at most one folder before the file name. May throw.
using NamedFileSink = std::function<void(const std::string& name, std::span<const std::byte> content)>;
// called with the number of chunks written, and of all; may throw
using LodProgress = std::function<void(uint64_t done, uint64_t all)>;

// Writes the files. `model` must be made from `set`. Returns the number of chunks of each level. Throws as
// writeGaussianSog(). The bytes do not depend on the number of threads.
std::vector<size_t> writeStreamedSog(const GaussianSet& set, const LodModel& model, const NamedFileSink& write,
                                     int threads, const LodProgress& progress);

using NamedFileReader = std::function<std::vector<std::byte>(const std::string& name)>;

// Reads the Gaussians of one level, rounded as they are stored. `read` returns a file of the folder. `name` is used in
// messages. Throws Error(InvalidFile).
GaussianSet readStreamedSog(const NamedFileReader& read, size_t level, const std::string& name);

} // namespace gsc
