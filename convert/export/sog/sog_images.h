// SPDX-License-Identifier: Apache-2.0
// Content of a SOG, whether it is a zip or a folder: meta.json and the images that it names.
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Names and contents, meta.json first.
using SogMembers = std::vector<std::pair<std::string, std::vector<std::byte>>>;

// `ends`: numbers of Gaussians, ascending to set.size(); those between two of them stay together, in Morton order. At most
// `most_palette` different harmonics. Throws as writeGaussianSog().
SogMembers makeSogMembers(const GaussianSet& set, std::span<const size_t> ends, size_t most_palette, int threads);

// `read` gives a member's content. `name` is used in messages. Throws Error(InvalidFile).
GaussianSet readSogMembers(const std::function<std::vector<std::byte>(const std::string&)>& read,
                           const std::string& name);

} // namespace gsc
