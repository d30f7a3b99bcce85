// SPDX-License-Identifier: Apache-2.0
// Makes and reads the content of a SOG, whether it lies in a zip or a folder: meta.json and the images that it names.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Names and contents of the files; meta.json comes first.
using SogMembers = std::vector<std::pair<std::string, std::vector<std::byte>>>;

// `ends`: ascending numbers of Gaussians, the last is set.size(). The Gaussians between two of them stay together in
// the file, in Morton order. `most_palette`: most sets of colour harmonics. Throws as writeGaussianSog().
SogMembers makeSogMembers(const GaussianSet& set, std::span<const size_t> ends, size_t most_palette, int threads);

// Reads the Gaussians. `read` returns the content of a file by its name. `name` is used in messages. Throws
// Error(InvalidFile).
GaussianSet readSogMembers(const std::function<std::vector<std::byte>(const std::string&)>& read,
                           const std::string& name);

} // namespace gsc
